import pytest

from ngi.explore import GrowingResolution


def test_growing_follows_the_paper() -> None:
    schedule = GrowingResolution(start=128, step=4, every=2000, end=600)
    published = {0: 128, 1999: 128, 2000: 132, 3999: 132, 4000: 136, 235_999: 596, 236_000: 600}
    assert {i: schedule.resolution(i) for i in published} == published
    assert schedule.resolution(10**9) == 600


def test_growing_stops_at_an_end_it_does_not_hit_by_steps() -> None:
    schedule = GrowingResolution(start=10, step=4, every=1, end=17)
    assert [schedule.resolution(i) for i in range(4)] == [10, 14, 17, 17]


def test_without_a_step_it_stays() -> None:
    schedule = GrowingResolution(start=128, step=0, every=2000, end=64)  # which is nothing then
    assert {schedule.resolution(i) for i in (0, 2000, 10**9)} == {128}


@pytest.mark.parametrize(
    ("key", "value"), [("start", 0), ("start", -1), ("step", -1), ("every", 0), ("end", 0)]
)
def test_growing_rejects_what_is_not_positive(key, value) -> None:
    arguments = {"start": 128, "step": 4, "every": 2000, "end": 600} | {key: value}
    with pytest.raises(ValueError, match=f"{key}: {value}"):
        GrowingResolution(**arguments)


def test_other_bad_values_are_rejected() -> None:
    with pytest.raises(ValueError, match="end: 100"):
        GrowingResolution(start=128, step=4, every=2000, end=100)
    with pytest.raises(ValueError, match="iteration: -1"):
        GrowingResolution(start=128, step=4, every=2000, end=600).resolution(-1)
