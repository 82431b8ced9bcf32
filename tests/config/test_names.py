import pytest

from ngi.files.run_names import LONGEST, run_group, run_name
from tests.config.command_line import composed


@pytest.mark.parametrize(
    ("overrides", "name"),
    [
        ("", "default"),
        (None, "default"),
        ("sampler=uniform", "sampler=uniform"),
        ("+sweeps=demo,method=uniform", "sweeps=demo,method=uniform"),
        ("run.folder=/tmp/x y", "run.folder=_tmp_x_y"),
    ],
)
def test_names_are_readable(overrides: str | None, name: str) -> None:
    assert run_name(overrides) == name


def test_long_names_are_cut_but_stay_apart() -> None:
    a, b = run_name("x" * 300 + "=1"), run_name("x" * 300 + "=2")
    assert a != b
    assert len(a) < LONGEST + 12


def test_a_run_says_all_its_overrides_however_long_its_folders_name() -> None:
    """By all but the method runs of one way are found (`analysis.pairs`)."""
    words = [f"model.option_{number}=1" for number in range(10, 30)]
    config = composed(*(f"+{word}" for word in words), "method=uniform")
    assert sorted(config.label.overrides.split(",")) == ["method=uniform", *words]
    folder = config.run.folder.split("/")[-2]
    assert folder == run_name(config.label.overrides)
    assert len(folder) < LONGEST + 12 < len(config.label.overrides)


def test_runs_are_grouped_by_experiment_or_budget_and_by_clock() -> None:
    assert run_group("demo", "small", "wall") == "demo"
    assert run_group(None, "small", "wall") == "small"
    assert run_group(None, "small", "model") == "small-model-clock"


def test_what_a_tracker_is_told_names_no_run() -> None:
    """Else runs would differ by it where they are compared."""
    config = composed(
        *("tracker=wandb", "tracker.project=p", "tracker.mode=online", "tracker.tags=[a,b]"),
        *("tracker.network=true", "tracker.every=2"),
    )
    assert config.label.overrides == "default"
    assert config.tracker.tags == ["a", "b"]


def test_the_environment_chooses_project_and_mode_at_wandb(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WANDB_PROJECT", "lab")
    monkeypatch.setenv("WANDB_MODE", "online")
    told = composed("tracker=wandb").tracker
    assert (told.project, told.mode) == ("lab", "online")
    given = composed("tracker=wandb", "tracker.project=mine").tracker
    assert (given.project, given.mode) == ("mine", "online")
