import pytest

from ngi.studies.benchmark import PATCHES, waiting, workers


def test_throughput_counts_patches_and_says_what_is_computed() -> None:
    patches = workers.AHEAD * PATCHES
    figures = workers.throughput_figures([0, 1, 2], [[2.0, 4.0], [2.0, 4.0], [1.0, 2.0]])
    measured = {f.name: f for f in figures}
    assert measured["in one process"].median == pytest.approx(0.75 * patches / 2)
    assert measured["2 workers"].median == pytest.approx(0.75 * patches)
    assert measured["1 worker / in one process"].median == 1
    assert measured["2 workers / in one process"].median == 2
    computed = {name: f.median for name, f in measured.items() if "computed" in name}
    assert computed["8 workers of 8 cores, computed"] == pytest.approx(4 * 0.75 * patches)
    assert "2 workers of 2 cores, computed" not in computed


@pytest.mark.parametrize(
    ("cores", "counts"), [(1, [0, 1]), (2, [0, 1, 2]), (6, [0, 1, 2, 4, 6]), (8, [0, 1, 2, 4, 8])]
)
def test_workers_double_up_to_the_cores_at_hand(cores: int, counts: list[int]) -> None:
    assert workers.worker_counts(cores) == counts


def test_waiting_is_what_the_renderer_takes_of_the_run_time() -> None:
    in_turn = [{"seconds": {"render": 4.0, "train": 6.0}, "run_seconds": 10.0, "steps": 100}] * 2
    ahead = [{"seconds": {"render": 1.0, "train": 7.0}, "run_seconds": 8.0, "steps": 100}] * 2
    measured = {f.name: f.median for f in waiting.waiting_figures(in_turn, ahead)}
    assert measured["waiting for patches, in turn"] == 40
    assert measured["waiting for patches, one worker ahead"] == 12.5
    assert measured["one worker ahead / in turn"] == 1.25


def test_a_run_that_fails_says_why() -> None:
    with pytest.raises(RuntimeError, match=r"failed:\n(.*\n)*.*nowhere"):
        waiting.result_of_run(["scene=nowhere"], workers=0)
