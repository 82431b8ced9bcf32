"""Renderer actors on a Ray cluster of this machine."""

import logging
import os
import signal
from functools import partial

import pytest

pytest.importorskip("ray", reason="the extra 'ray' is missing")

import ray

from ngi.render.ray_workers import Share, share_out
from ngi.render.workers import WorkerRenderer
from tests.render.odd_renderer import OddRenderer, assert_same, render, states
from tests.waiting import wait_for


@pytest.fixture
def two(tmp_path):
    with WorkerRenderer(
        partial(OddRenderer, gate=tmp_path / "open"), workers=2, cluster="local"
    ) as renderer:
        yield renderer
    ray.shutdown()


def test_actors_give_the_same_also_when_one_dies(two, tmp_path, caplog) -> None:
    here, gate = OddRenderer(gate=tmp_path / "open"), tmp_path / "open"
    two.warm_up()
    assert_same(render(two, states(40)), render(here, states(40)))
    with pytest.raises(KeyError, match="one half"):
        render(two, states(2, first=0.5))
    job = two.start_patches(states(16, first=0.25), resolution=20, seed=7)
    wait_for(lambda: len(list(tmp_path.iterdir())) == 2)
    victim = int(min(path.name for path in tmp_path.iterdir()))
    os.kill(victim, signal.SIGKILL)
    wait_for(lambda: caplog.records)
    assert not job.done()
    gate.touch()
    wait_for(job.done)
    assert_same(job.result(), render(here, states(16, first=0.25)))
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert f"pid: {victim}" in record.message
    assert "patches are rendered again" in record.message


@pytest.mark.parametrize(
    ("machines", "workers", "share"),
    [
        ([{"CPU": 8.0}], 2, Share(4, 0)),
        ([{"CPU": 8.0}], 3, Share(2, 0)),
        ([{"CPU": 8.0}, {"CPU": 8.0}], 3, Share(4, 0)),  # 5 would leave room for two only
        ([{"CPU": 2.0}, {"CPU": 9.0}], 4, Share(2, 0)),
        ([{"CPU": 16.0, "GPU": 2.0}], 2, Share(8, 1)),
        ([{"CPU": 16.0, "GPU": 2.0}, {"CPU": 64.0}], 3, Share(5, 0.5)),
        ([{"CPU": 4.0}, {"memory": 1.0}], 1, Share(4, 0)),
    ],
)
def test_shares_are_as_large_as_fits(machines, workers, share) -> None:
    assert share_out(machines, workers) == share


def test_a_full_cluster_says_so() -> None:
    with pytest.raises(RuntimeError, match=r"renderer\.workers=5: .* CPUs for 4 workers"):
        share_out([{"CPU": 4.0}], 5)
