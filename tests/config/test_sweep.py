"""What a sweep says before, between and after its runs, as its user sees it."""

import atexit
import json
import re
import shutil
from pathlib import Path

import pytest
from omegaconf import OmegaConf

from ngi.config import sweep as program
from ngi.config.sweep import Sweep, progress
from ngi.config.sweep_plan import Planned, duration, table
from tests.learn.command_line import SIZE, SMALL, run, run_module

PLACE = (
    "run.folder='outputs/steps/${optimizer.lr}-${seed}'"  # names of their own would be long and cut
)
SWEEP = (*SIZE, "budget=steps", "budget.steps=12", "seed=0,1", "sampler=uniform", PLACE)


def sweep(folder: Path, *words: str, options: tuple[str, ...] = ("-m",)) -> tuple[int, str]:
    return run(folder, *words, options=options, base=SWEEP)


def rows(output: str) -> dict[str, list[str]]:
    """State and what follows of each run of the table, by its folder's name."""
    found = {}
    for line in output.splitlines():
        if match := re.match(r"outputs/steps/(\S+)\s+(.*)", line):
            found[match[1]] = re.split(r"\s{2,}", match[2].strip())[:3]
    return found


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder and output of a sweep of four runs, one of which is refused its optimiser."""
    folder = tmp_path_factory.mktemp("sweep")
    status, output = sweep(folder, "optimizer.lr=1e-3,-1")
    assert status == 1, output
    return folder, output


def test_before_it_starts_its_runs_are_listed(finished: tuple[Path, str]) -> None:
    _, output = finished
    before = output.split("Launching")[0]
    assert rows(before) == {
        name: ["new", "0%", "?"] for name in ("0.001-0", "-1-0", "0.001-1", "-1-1")
    }
    assert "4 runs: 4 new; how long they take is unknown" in before
    words = re.findall(r"0%\s+\?\s+(.*)", before)
    expected = [f"optimizer.lr={lr} seed={seed}" for lr in ("0.001", "-1") for seed in (0, 1)]
    assert sorted(words) == sorted(expected)


def test_a_line_says_how_far_it_is_after_every_run(finished: tuple[Path, str]) -> None:
    lines = [line for line in finished[1].splitlines() if line.startswith("sweep: ")]
    assert [line.split(",")[0] for line in lines] == [
        f"sweep: {number} of 4 runs done" for number in (1, 2, 3, 4)
    ]
    failed = [re.search(r", (\d) failed", line) for line in lines]
    assert [match and match[1] for match in failed] == [None, None, "1", "2"]
    assert all(re.search(r"\d:\d\d so far", line) for line in lines)
    assert all(re.search(r"about \d:\d\d left", line) for line in lines[:3])
    assert "left" not in lines[3]


def test_in_the_end_it_says_what_failed_and_why(finished: tuple[Path, str]) -> None:
    folder, output = finished
    end = output[output.index("2 runs of this sweep failed:") :].splitlines()
    assert len(end) == 3
    for seed, line in enumerate(end[1:]):
        assert line == f"  outputs/steps/-1-{seed}: optimizer: Invalid learning rate: -1"
    assert not [*folder.rglob(".sweep-*")]


def test_of_what_could_not_be_made_it_says_why_as_the_run_does(tmp_path: Path) -> None:
    status, output = sweep(tmp_path, "seed=0", "budget.steps=null", "budget.seconds=null")
    assert status == 1
    (line,) = output[output.index("1 run of this sweep failed:") :].splitlines()[1:]
    assert "budget.steps and budget.seconds are both null" in line


def test_two_sweeps_of_one_folder_keep_their_notes_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In containers their processes may have the same number; a killed one leaves its notes."""
    monkeypatch.setattr(program, "_planned", lambda _: [])
    monkeypatch.setattr(atexit, "register", lambda _: None)
    config = OmegaConf.create({"hydra": {"sweep": {"dir": str(tmp_path / "new")}}})
    for _ in range(2):
        Sweep(dry_run=False).on_multirun_start(config)
    assert [[*folder.iterdir()] for folder in (tmp_path / "new").iterdir()] == [[], []]


def contents(folder: Path) -> dict[Path, bytes]:
    return {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def test_a_dry_run_says_what_is_finished_interrupted_longer_or_new_and_touches_nothing(
    finished: tuple[Path, str], tmp_path: Path
) -> None:
    place = tmp_path / "copy"
    shutil.copytree(finished[0], place)
    stopped = place / "outputs" / "steps" / "0.001-1"
    (stopped / "result.json").unlink()
    steps = (stopped / "steps.csv").read_text().splitlines(keepends=True)
    (stopped / "steps.csv").write_text("".join(steps[:4]))  # the header and three of twelve
    before = contents(place)
    words = ("seed=0,1,2", "optimizer.lr=1e-3")
    status, output = sweep(place, *words, options=("-m", "--dry-run"))
    assert status == 0, output
    assert contents(place) == before
    found = rows(output)
    assert found["0.001-0"] == ["finished", "100%", "0:00"]
    assert found["0.001-1"] == ["interrupted", "25%", "?"]
    assert found["0.001-2"] == ["new", "0%", "?"]
    assert "3 runs: 1 finished, 1 interrupted, 1 new" in output
    assert "Launching" not in output

    status, output = sweep(place, *words, "budget.steps=24", options=("-m", "--dry-run"))
    assert rows(output)["0.001-0"][:2] == ["longer", "50%"]


def test_what_cannot_start_is_named_beforehand(finished: tuple[Path, str]) -> None:
    place, _ = finished
    before = contents(place)
    words = ("seed=0", "optimizer.lr=1e-3", "model.hidden_features=16,32")
    status, output = sweep(place, *words, options=("-m", "--dry-run"))
    assert status == 1
    differs = "model.hidden_features: 16 there, 32 now"
    assert f"cannot start: its folder holds another run ({differs})" in output
    assert "delete" not in output  # it may be finished
    assert "1 finished, 1 cannot start" in output
    assert contents(place) == before


def test_what_has_no_checkpoint_can_not_be_planned_longer(
    finished: tuple[Path, str], tmp_path: Path
) -> None:
    place = tmp_path / "copy"
    shutil.copytree(finished[0], place)
    for checkpoint in place.rglob("*.ckpt"):
        checkpoint.unlink()
    words = ("seed=0", "optimizer.lr=1e-3", "budget.steps=24")
    status, output = sweep(place, *words, options=("-m", "--dry-run"))
    assert status == 1
    assert "cannot start: it cannot be trained longer: there is no checkpoint" in output


def test_scenes_of_two_names_are_two_runs(tmp_path: Path) -> None:
    """Closed formulas are the same whatever the scene is called, and a run is not."""
    words = ("seed=0", "scene=mirror,cornell-box")
    status, output = sweep(tmp_path, *words, options=("-m", "--dry-run"))
    assert status == 1
    assert "an earlier run of this sweep uses its folder" in output


def test_a_plan_names_values_and_folders_with_which_runs_cannot_start(tmp_path: Path) -> None:
    status, output = sweep(tmp_path, "sampler.chains=4,0", options=("-m", "--dry-run"))
    assert status == 1, output
    assert len(re.findall("cannot start: .*sampler.chains", output)) == 2
    assert "2 new" in output
    folder = f"run.folder={tmp_path / 'one'}"
    status, output = sweep(tmp_path, folder, options=("-m", "--dry-run"))
    assert status == 1, output
    assert "1 new" in output
    assert "an earlier run of this sweep uses its folder" in output


def test_a_key_that_all_options_of_a_sweep_have_is_given_with_two_plus_signs(
    tmp_path: Path,
) -> None:
    words = ("method=ours,ours_uniform", "renderer=mitsuba", "scene=mirror", "data=patches")
    status, output = sweep(tmp_path, *words, "model.octaves=3", options=("-m", "--dry-run"))
    assert status == 1
    assert "model.octaves: there is no such key; there are " in output
    assert "++model.octaves=…" in output
    status, output = sweep(tmp_path, *words, "++model.octaves=3", options=("-m", "--dry-run"))
    assert "model.octaves: there is no such key" not in output


def test_seconds_are_known_and_one_run_alone_has_a_dry_run_too(tmp_path: Path) -> None:
    words = ("budget=seconds", "budget.seconds=90", PLACE)
    status, output = run(tmp_path, *words, options=("--dry-run",), base=SIZE)
    assert status == 0, output
    assert "new      0%      1:30" in output
    assert "1 run: 1 new; about 1:30 of training left" in output
    assert not (tmp_path / "outputs").exists()


@pytest.mark.parametrize("scene", ["mirror", "archviz"])
def test_a_path_traced_scene_has_a_dry_run_too(scene: str, tmp_path: Path) -> None:
    """Whatever its description holds: tuples of names and paths were once none of OmegaConf's."""
    words = (f"scene={scene}", "budget=seconds", "budget.seconds=90", PLACE, "--dry-run")
    status, output = run_module("ngi.train", *words, folder=tmp_path)
    assert status == 0, output
    assert "1 run: 1 new; about 1:30 of training left" in output


def test_steps_take_what_they_were_measured_to_cost(tmp_path: Path) -> None:
    """The cost file is written by hand: as many seconds a step as its components have together."""
    from ngi.config.build import run_components
    from ngi.learn import CostFile
    from ngi.render import AnalyticRenderer
    from tests.learn.composition import run_config

    words = ("budget=steps", "budget.steps=1000", "sampler=mcmc_loss_step")
    config = run_config(*SIZE, *words)
    renderer = AnalyticRenderer(dimensions=3, patch_size=16)
    file = CostFile(tmp_path / "costs.json")
    for component in run_components(config, renderer=renderer):
        file.add(component, {"train": [0.1]}, measured_by={})
    assert len(json.loads(file.path.read_text())["components"]) == 4
    status, output = run(
        tmp_path, *words, f"budget.costs={file.path}", options=("--dry-run",), base=SIZE
    )
    assert status == 0, output
    assert "1 run: 1 new; about 6:40 of training left" in output


def test_without_a_file_of_costs_nobody_knows_how_long_steps_take(tmp_path: Path) -> None:
    words = ("budget=steps", "budget.steps=9", "budget.costs=null", PLACE)
    status, output = run(tmp_path, *words, options=("--dry-run",), base=SIZE)
    assert status == 0, output
    assert "1 run: 1 new; how long they take is unknown" in output


def test_a_clock_without_costs_is_said_before_anything_runs(tmp_path: Path) -> None:
    words = ("budget=seconds", "budget.clock=model", "budget.costs=none.json", PLACE)
    status, output = run(tmp_path, *words, options=("--dry-run",), base=SIZE)
    assert status == 1, output
    assert "cannot start: budget.costs: none.json does not exist; measure it with" in output


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-m", "scene=mirror,miror"), "NGI_SCENES; did you mean 'mirror'?"),
        (("scene=release",), "scene.path: it has to be given"),
    ],
)
def test_what_a_dry_run_cannot_compose_is_said_as_a_run_says_it(
    tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    status, output = run_module("ngi.train", *words, "--dry-run", folder=tmp_path)
    assert status == 1
    assert message in output
    assert "provider" not in output
    assert "full_key" not in output


BROKEN = """
import ngi.config.sweep as sweep
import ngi.train

def broken(*_):
    raise KeyError("a bug of the plan")

sweep.planned_runs = sweep.planned_run = broken
ngi.train.main()
"""


@pytest.mark.parametrize("multirun", [("-m",), ()], ids=["sweep", "one run"])
def test_a_bug_in_the_plan_of_a_dry_run_trains_nothing(
    tmp_path: Path, multirun: tuple[str, ...]
) -> None:
    (tmp_path / "broken.py").write_text(BROKEN)
    status, output = run_module("broken", *multirun, "--dry-run", *SMALL, PLACE, folder=tmp_path)
    assert status == 1, output
    assert "a bug of the plan" in output
    assert "this is a bug; nothing was trained" in output
    assert "Launching" not in output
    assert not (tmp_path / "outputs").exists()


def test_a_dry_run_whose_plan_is_taken_away_trains_nothing(tmp_path: Path) -> None:
    status, output = sweep(
        tmp_path, "seed=0", "~hydra.callbacks.sweep", options=("-m", "--dry-run")
    )
    assert status == 1, output
    assert "nothing is trained" in output
    assert not [*tmp_path.rglob("steps.csv")]


def test_a_folder_with_other_settings_is_named(tmp_path: Path) -> None:
    folder = tmp_path / "outputs" / "steps" / "0.001-0"
    folder.mkdir(parents=True)
    (folder / "last.ckpt").touch()
    (folder / "settings.json").write_text("{}")
    status, output = sweep(tmp_path, "seed=0", options=("-m", "--dry-run"))
    assert status == 1, output
    assert "settings.json is not of a run" in output
    (folder / "settings.json").write_text("{")
    _, output = sweep(tmp_path, "seed=0", options=("-m", "--dry-run"))
    assert "settings.json is damaged" in output
    (folder / "settings.json").unlink()  # as a run then goes on
    status, output = sweep(tmp_path, "seed=0", options=("-m", "--dry-run"))
    assert status == 0, output
    assert rows(output)["0.001-0"][:2] == ["interrupted", "0%"]


def planned(state: str, left: float | None) -> Planned:
    return Planned(Path("/runs") / state, state, 0.0, left)


def test_what_is_left_goes_by_what_was_left_of_each() -> None:
    runs = [
        planned("finished", 0),
        planned("new", 100),
        planned("interrupted", 50),
        planned("new", 50),
    ]
    assert progress(runs, [0], 0, 2) == "sweep: 1 of 4 runs done, 0:02 so far"
    assert progress(runs, [0, 1], 1, 120).endswith("1 failed, 2:00 so far, about 2:00 left")
    assert progress(runs, [0, 2, 1], 0, 120).endswith("2:00 so far, about 0:40 left")
    assert progress(runs, [0, 1, 2, 3], 0, 240) == "sweep: 4 of 4 runs done, 4:00 so far"


def test_unknown_times_count_as_the_typical_one() -> None:
    runs = [planned("new", None), planned("new", 100), planned("new", None)]
    assert progress(runs, [0], 0, 10).endswith("about 0:20 left")
    assert progress([planned("new", None)] * 2, [0], 0, 10).endswith("about 0:10 left")


def test_the_table_adds_up() -> None:
    runs = [planned("new", 3000), planned("interrupted", 700), planned("again", None)]
    shown = table([*runs, planned("finished", 0), planned("cannot start: no", None)])
    assert "5 runs: 1 new, 1 interrupted, 1 again, 1 finished, 1 cannot start;" in shown
    assert "about 1:01:40 of training left; how long 1 of them take is unknown" in shown


@pytest.mark.parametrize(
    ("seconds", "shown"),
    [(0, "0:00"), (59.2, "1:00"), (3599, "59:59"), (3600, "1:00:00"), (None, "?")],
)
def test_durations(seconds: float | None, shown: str) -> None:
    assert duration(seconds) == shown
