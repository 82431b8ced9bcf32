"""Memory that was freed is used again, instead of being mapped anew by the kernel."""

import os
import subprocess
import sys

import pytest

from ngi.machine import memory

TOOL = """
import resource
import sys
from dataclasses import dataclass

import torch

from ngi.config.options import run_tool


@dataclass
class Nothing:
    "No options."


def work(_):
    for times in (30, 20):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        for _ in range(times):
            torch.ones(2**21)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)


if sys.argv[1] == "tool":
    run_tool(work, Nothing, "ngi nothing", [])
else:
    work(None)
"""
PAGES = 20 * 2**23 // 2**12
"""That are written to after the warm-up."""


def page_faults(how: str) -> int:
    """Where malloc, left to itself, would give every large block back at once."""
    command = [sys.executable, "-c", TOOL, how]
    environment = {**os.environ, "MALLOC_MMAP_THRESHOLD_": str(2**16)}
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    return int(done.stdout)


@pytest.mark.skipif(memory._of_c_library("mallopt") is None, reason="another C library than glibc")
def test_every_tool_keeps_what_it_frees() -> None:
    assert page_faults("tool") < PAGES / 100
    assert page_faults("plainly") > PAGES / 2  # so that the number above says something
