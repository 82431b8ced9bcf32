"""On one core: Dr.Jit has no worker thread there, but Mitsuba waits for one with every EXR file."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TIMEOUT = 120
"""Seconds; what is run here takes a few, where it does not hang."""

WRITES_AND_READS = """
import sys
import torch
from pathlib import Path
from ngi.machine.backend import dr
from ngi.render.exr import read_exr, write_exr

path = Path(sys.argv[1])
write_exr(path, torch.full((40, 24, 3), 0.5))
print(read_exr(path).shape, dr.thread_count(), "thread")
"""

SCENE = """<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="perspective" id="camera"/>
    <shape type="sphere" id="ball"><bsdf type="diffuse" id="matte"/></shape>
    <emitter type="envmap" id="sky"><string name="filename" value="sky.exr"/></emitter>
</scene>"""


def _on_one_core(*arguments: str) -> str:
    """What Python prints when it runs with these arguments on a single core."""
    core = min(os.sched_getaffinity(0))
    ran = subprocess.run(
        [sys.executable, *arguments],
        timeout=TIMEOUT,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: os.sched_setaffinity(0, {core}),
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no affinities")
def test_exr_files_are_written_and_read(tmp_path: Path) -> None:
    sky, file = tmp_path / "sky.exr", tmp_path / "plain.xml"
    # A thread of Dr.Jit's own would take a third of the only core's time by waiting for work.
    assert "[40, 24, 3]) 1 thread" in _on_one_core("-c", WRITES_AND_READS, str(sky))
    file.write_text(SCENE)
    described = _on_one_core("-m", "ngi", "describe", str(file), "backend=scalar")
    assert "sky" in described
