"""Renderer processes: the numbers of one renderer, whatever happens to them."""

import logging
import os
import pickle
import re
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
import torch
from omegaconf import open_dict

from ngi.config.configuration import run_settings
from ngi.machine.backend import llvm_problem
from ngi.render import watchdog
from ngi.render.mitsuba_renderer import HalvesRenderer
from ngi.render.worker_process import WorkerProcess, visible_gpus
from ngi.render.worker_protocol import Request
from ngi.render.workers import WorkerRenderer, mitsuba_renderer
from ngi.scene import read_scene, scenes
from tests.config.command_line import composed
from tests.render.odd_renderer import (
    OddRenderer,
    PlaceRenderer,
    assert_same,
    processes,
    render,
    states,
)
from tests.waiting import wait_for


@pytest.fixture(scope="module")
def gate(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("gate") / "open"


@pytest.fixture(scope="module")
def two(gate):
    """Two processes, and what they render once `gate` is there."""
    with WorkerRenderer(partial(OddRenderer, gate=gate), workers=2) as renderer:
        renderer.warm_up()
        yield renderer


@pytest.fixture
def here(gate):
    """The same renderer in this process."""
    yield OddRenderer(gate=gate)
    gate.unlink(missing_ok=True)


def test_few_pixels_are_had_as_they_are_asked_for(two, monkeypatch) -> None:
    asked = []
    monkeypatch.setattr(
        two._local, "pixel_buffers", lambda *given, **options: asked.append((given, options))
    )
    v, pixels = torch.zeros(3), torch.tensor([1])
    two.pixel_buffers(v, pixels, resolution=9, samples=4, caustics=False)
    two.pixel_buffers(v, pixels, resolution=9)
    with_all = {"resolution": 9, "samples": None, "caustics": True}
    few = {"resolution": 9, "samples": 4, "caustics": False}
    assert asked == [((v, pixels), few), ((v, pixels), with_all)]


def test_processes_give_the_same(two, here) -> None:
    for seed in range(3):
        given = states(40, seed)
        assert render(here, given, seed).masked > 0
        assert_same(render(two, given, seed), render(here, given, seed))
    v = states(1)[0, :3]
    assert torch.equal(
        two.image_buffers(v, resolution=9),
        here.image_buffers(v, resolution=9),
    )
    pixels = torch.tensor([80, 3])
    assert torch.equal(
        two.pixel_buffers(v, pixels, resolution=9),
        two.image_buffers(v, resolution=9).flatten(0, 1)[pixels],
    )
    assert torch.equal(
        two.render_image(v, resolution=9, samples_per_pixel=2, seed=1),
        here.render_image(v, resolution=9, samples_per_pixel=2, seed=1),
    )
    assert torch.equal(two.hard_frames(), here.hard_frames())
    assert (two.scene_hash, two.layout) == (here.scene_hash, here.layout)
    assert torch.equal(two.moving_points.weight, here.moving_points.weight)
    assert two.description == f"{here.description}, workers: 2"


def test_jobs_end_on_their_own_in_any_order(two, here, gate) -> None:
    slow, fast = states(16, 1, first=0.25), states(16, 2)
    slow[1:] = states(15, 3)  # one of two workers waits, the other goes on
    jobs = [two.start_patches(given, resolution=20, seed=7) for given in (slow, fast)]
    wait_for(jobs[1].done)
    assert not jobs[0].done()
    gate.touch()
    wait_for(jobs[0].done)
    assert jobs[0].result() is jobs[0].result()
    for job, given in zip(jobs, (slow, fast), strict=True):
        assert_same(job.result(), render(here, given))


def test_work_of_a_killed_process_is_done_again(two, here, gate, caplog) -> None:
    before = processes()
    given = states(16, first=0.25)
    job = two.start_patches(given, resolution=20, seed=7)
    victim = min(before)
    wait_for(gate.with_name(str(victim)).exists)  # in the middle of a patch
    os.kill(victim, signal.SIGKILL)
    wait_for(lambda: len(processes() - before) == 1)
    assert not job.done()
    gate.touch()
    wait_for(job.done)
    assert_same(job.result(), render(here, given))
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert re.fullmatch(
        rf"renderer process [01] \(pid {victim}\) died \(SIGKILL\); it is replaced, and "
        r"[1-9] patches are rendered again",
        record.message,
    )
    assert len(processes()) == 2


def test_work_of_a_stopped_process_is_done_again(two, here, caplog, monkeypatch) -> None:
    assert_same(render(two, states(8)), render(here, states(8)))  # there has been a reply
    monkeypatch.setattr(watchdog, "SHORTEST_SECONDS", 2)
    monkeypatch.setattr(watchdog, "TIMES_THE_SLOWEST", 0)
    before = processes()
    victim = min(before)
    os.kill(victim, signal.SIGSTOP)
    given = states(16, 4)
    assert_same(render(two, given), render(here, given))
    (record,) = caplog.records
    assert re.fullmatch(
        rf"renderer process [01] \(pid {victim}\) died \(killed: no answer within 2 s\); it is "
        r"replaced, and [1-9] patches are rendered again",
        record.message,
    )
    assert victim not in processes()
    assert len(processes()) == 2


def test_what_rendering_raises_comes_out_and_the_worker_lives_on(two, here) -> None:
    before = processes()
    job = two.start_patches(states(3, first=0.5), resolution=20, seed=7)
    for _ in range(2):
        with pytest.raises(KeyError, match="one half") as raised:
            job.result()
    assert "odd_renderer.py" in "".join(raised.value.__notes__)
    assert_same(render(two, states(8)), render(here, states(8)))
    assert processes() == before


def test_closing_ends_processes_and_jobs(gate) -> None:
    before = processes()
    renderer = WorkerRenderer(partial(OddRenderer, gate=gate), workers=2)
    assert processes() == before  # started when they are needed
    job = renderer.start_patches(states(8, first=0.25), resolution=20, seed=0)
    wait_for(lambda: len(processes() - before) == 2)
    for _ in range(2):
        renderer.close()
    assert processes() == before
    for use in (job.result, renderer.warm_up, lambda: render(renderer, states(1))):
        with pytest.raises(RuntimeError, match="the renderer is closed"):
            use()


PARENT = """
import sys, torch
from functools import partial
from pathlib import Path
from ngi.render.workers import WorkerRenderer
from tests.render.odd_renderer import OddRenderer, processes

renderer = WorkerRenderer(partial(OddRenderer, gate=Path(sys.argv[1])), workers=1)
renderer.warm_up()
job = renderer.start_patches(torch.full((2, 5), 0.25), resolution=20, seed=0)
print(*processes(), flush=True)
{end}
"""


def alive(pid: int) -> bool:
    """A zombie whose parent is gone is not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("end", ["job.result()", "raise SystemExit(3)"])
def test_a_worker_ends_with_its_parent(tmp_path, end) -> None:
    """In the middle of a patch, whether the parent is killed or forgets to close it."""
    script = [sys.executable, "-c", PARENT.format(end=end), str(tmp_path / "gate")]
    with subprocess.Popen(script, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        worker = int(parent.stdout.readline())
        if end == "job.result()":
            assert alive(worker)
            parent.kill()
        else:
            assert parent.wait() == 3
    wait_for(lambda: not alive(worker))


def test_a_process_has_its_share_of_the_machine(monkeypatch, tmp_path) -> None:
    monkeypatch.chdir(tmp_path)  # what is imported here can be imported there
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 2)
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "5,7")
    assert visible_gpus() == ["5", "7"]
    worker = WorkerProcess(0, of=2, make=pickle.dumps(PlaceRenderer))
    try:
        assert worker.receive() is None
        worker.send(Request(states(1), resolution=20, seed=0))
        reply = worker.receive()
    finally:
        worker.kill()
        worker.release()
    assert (reply.paths, reply.repaired, reply.masked) == (7, os.nice(0), 1)


def test_gpus_are_those_that_cuda_may_see(monkeypatch) -> None:
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 0)
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "0,1")
    assert visible_gpus() == []
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES")
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 3)
    assert visible_gpus() == ["0", "1", "2"]


def test_training_goes_first_and_ctrl_c_is_its_own(two) -> None:
    two.warm_up()
    lower = os.nice(0) + 10
    wait_for(lambda: {os.getpriority(os.PRIO_PROCESS, pid) for pid in processes()} == {lower})
    assert os.getpgrp() not in {os.getpgid(pid) for pid in processes()}


def test_mitsuba_in_another_process_gives_the_same() -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    options = {
        "scene": read_scene(**scenes()["mirror"]),
        "backend": "llvm",
        "patch_size": 16,
        "samples_per_pixel": 8,
        "halves": True,
    }
    alone = mitsuba_renderer(workers=0, cluster=None, **options)
    assert type(alone) is HalvesRenderer
    given = torch.rand(6, 4, generator=torch.Generator().manual_seed(0))
    with mitsuba_renderer(workers=1, cluster=None, **options) as renderer:
        for resolution in (32, 48):
            results = [
                r.render_patches(given, resolution=resolution, seed=3) for r in (alone, renderer)
            ]
            assert_same(*results)
            assert results[0].first_half is not None


def test_the_configuration_is_checked(monkeypatch) -> None:
    with pytest.raises(ValueError, match=r"renderer\.workers is -1"):
        WorkerRenderer(PlaceRenderer, workers=-1)
    with pytest.raises(ValueError, match=r"renderer\.cluster 'auto' needs workers"):
        mitsuba_renderer(workers=0, cluster="auto", scene=None)
    monkeypatch.setitem(sys.modules, "ray", None)  # as if it were not installed
    monkeypatch.delitem(sys.modules, "ngi.render.ray_workers", raising=False)
    with pytest.raises(RuntimeError, match=r"renderer\.cluster 'auto' needs Ray; get it"):
        WorkerRenderer(PlaceRenderer, workers=1, cluster="auto")


def test_workers_are_no_part_of_a_runs_identity() -> None:
    settings = []
    for overrides in ([], ["renderer.workers=4", "renderer.cluster=auto"]):
        config = composed(*overrides, "run.folder=here")
        assert config.hydra.job.override_dirname == ""
        with open_dict(config):
            del config.hydra
        settings.append(run_settings(config, scene_hash="", costs=None))
    assert settings[0] == settings[1]
