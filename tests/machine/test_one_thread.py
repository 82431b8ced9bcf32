"""With one thread: Dr.Jit has no worker then, but Mitsuba waits for one with every EXR file."""

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


def _printed(limit: str, *arguments: str) -> str:
    """What Python prints when it runs with these arguments on one core, or told to use one."""
    environment = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    usable = os.sched_getaffinity(0)
    if limit == "OMP_NUM_THREADS":
        environment[limit] = "1,1"  # of nested regions as well
    else:
        usable = {min(usable)}
    ran = subprocess.run(
        [sys.executable, *arguments],
        timeout=TIMEOUT,
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        preexec_fn=lambda: os.sched_setaffinity(0, usable),
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no affinities")
@pytest.mark.parametrize("limit", ["core", "OMP_NUM_THREADS"])
def test_exr_files_are_written_and_read(tmp_path: Path, limit: str) -> None:
    sky, file = tmp_path / "sky.exr", tmp_path / "plain.xml"
    # A thread of Dr.Jit's own would take a third of the only core's time by waiting for work.
    assert "[40, 24, 3]) 1 thread" in _printed(limit, "-c", WRITES_AND_READS, str(sky))
    file.write_text(SCENE)
    described = _printed(limit, "-m", "ngi", "describe", str(file), "backend=scalar")
    assert "sky" in described


@pytest.mark.parametrize("limit", ["", "none", "0", "1000"])
def test_other_limits_leave_the_threads_as_they_are(limit: str) -> None:
    code = "import drjit as dr; n = dr.thread_count(); import ngi.machine.backend; "
    code += "print(dr.thread_count() == n)"
    ran = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "OMP_NUM_THREADS": limit},
    )
    assert ran.stdout.split() == ["True"]
