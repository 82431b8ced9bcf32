"""What is wrong with a command is said once, with the nearest of what there is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import torch
from hydra.errors import HydraException, MissingConfigException
from omegaconf.errors import OmegaConfBaseException

from ngi.config.configuration import composed
from ngi.config.hydra_program import explained, in_plain_words, run_program
from tests.learn.command_line import SMALL, run, run_module


@pytest.mark.parametrize(
    ("word", "message"),
    [
        (
            "model.hidden_feature=64",
            "model.hidden_feature: there is no such key; did you mean 'model.hidden_features'?",
        ),
        ("modl.hidden_features=3", "modl: there is no such key; did you mean 'model'?"),
        (
            "hidden_features=3",
            "hidden_features: there is no such key; did you mean 'model.hidden_features'?",
        ),
        ("methd=ours", "methd: there is no such key; did you mean 'method'?"),
        ("experimnt=demo", "experimnt: there is no such key; did you mean 'experiment'?"),
        ("sweeps=demo", "sweeps: give it with a plus, with -m: +sweeps=demo"),
        ("lr=3", "lr: there is no such key; did you mean 'optimizer.lr'?"),
        ("smapler=uniform", "smapler: there is no such key; did you mean 'sampler'?"),
        (
            "renderer.noise=3",
            "renderer.noise: there is no such key; there are renderer.dimensions, "
            "renderer.patch_size (+renderer.noise=… adds one)",
        ),
        (
            "optimizer=adm",
            "optimizer/adm: there is no such option; optimizer can be adam, adam_exploration_map, "
            "adam_small, adam_tuned, muon; did you mean 'adam'?",
        ),
        ("method=ours_without/caustic", "; did you mean 'caustics'?"),
        ("+sweeps=xyz", "sweeps/xyz: there is no such option; sweeps can be acceptance, anf, "),
        ("seed", "'seed': write key=value, without spaces around the ="),
        ("seed=[1", "'seed=[1': no viable alternative at input '[1'"),
        ("seed=0,1", "3. To sweep over it, give -m"),
        ("supersampled_edges=1", "_edges: there is no such key; there are seed, viewer, "),
        (
            "scene=./scenes/miror",
            "veach-egg; scenes are folders in ./scenes and $NGI_SCENES; did you mean 'mirror'?",
        ),
    ],
)
def test_of_what_does_not_exist_the_nearest_is_named(word: str, message: str) -> None:
    with pytest.raises(HydraException) as raised:
        composed("renderer=analytic", word)
    assert message in explained(raised.value)


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("budget=60", "budget=60: budget can be hour, .*; a number of seconds is budget.seconds=…"),
        ("resolution=128", "resolution=128: resolution can be constant, growing$"),
        ("+method=true", "method=true: method can be active_exploration, "),
        ("scene=3", "scene=3: scene can be archviz, .*, mirror, "),
    ],
)
def test_a_number_where_an_option_is_chosen_is_answered_by_the_options(
    tmp_path: Path, word: str, message: str
) -> None:
    status, output = run(tmp_path, word, base=())
    assert status == 1
    assert re.search(message, output.strip())
    assert "Traceback" not in output


@pytest.mark.parametrize("place", [".", "elsewhere"])
def test_of_a_scene_without_a_description_what_writes_one_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NGI_SCENES", str(tmp_path / "elsewhere"))
    folder = tmp_path / (place if place != "." else "scenes") / "attic"
    folder.mkdir(parents=True)
    (folder / "scene.xml").touch()
    with pytest.raises(HydraException) as raised:
        composed("renderer=analytic", "scene=attic")
    expected = f"; {folder} has no scene.yaml, `ngi describe {folder}/scene.xml` writes one"
    assert expected in explained(raised.value)


def test_a_full_graphics_card_is_told_what_takes_its_memory() -> None:
    said = in_plain_words(torch.OutOfMemoryError("CUDA out of memory"))
    assert said.startswith("CUDA out of memory\nthe GPU is out of memory: free some")
    assert "sampler.chains" in said
    assert in_plain_words(RuntimeError("CUDA")) == "CUDA"


def test_what_has_to_be_given_is_asked_for() -> None:
    config = composed("scene=release")
    with pytest.raises(OmegaConfBaseException) as raised:
        config.scene.name  # noqa: B018 - reading it is what fails
    assert explained(raised.value) == "scene.path: it has to be given, scene.path=…"


def test_of_a_part_without_a_class_nobody_is_told_to_add_a_key() -> None:
    with pytest.raises(HydraException) as raised:
        composed("run.folders=3")
    assert explained(raised.value).endswith("did you mean 'run.folder'?")
    with pytest.raises(HydraException) as raised:
        composed("run.zzz=3")
    assert "adds one" not in explained(raised.value)


def test_a_sweep_whose_settings_are_asked_for_is_told_how(tmp_path: Path) -> None:
    status, output = run_module("ngi.train", "-m", "seed=0,1", "--cfg", "job", folder=tmp_path)
    assert status == 1
    assert output.count("\n") == 1
    assert output.endswith("the settings of one run of a sweep, leave out -m: --cfg job\n")


@pytest.mark.parametrize("module", ["ngi.train", "ngi.studies.costs", "ngi.studies.noise"])
def test_a_mistyped_key_is_said_in_one_line_and_leaves_nothing(module: str, tmp_path: Path) -> None:
    words = ("renderer=analytic", "budget=smoke", "model.hidden_feature=64")
    status, output = run_module(module, *words, folder=tmp_path)
    assert status == 1
    assert output == (
        "model.hidden_feature: there is no such key; did you mean 'model.hidden_features'?\n"
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("tracker=wandb", "tracker.mode=maybe"), "tracker.mode: 'maybe'"),
        (
            ("model._target_=nowhere.Network",),
            "model._target_: 'nowhere.Network' cannot be imported: No module named 'nowhere'",
        ),
        (
            ("+renderer.direct=traced",),
            "renderer.direct: this renderer has no such setting; leave it out: ~renderer.direct",
        ),
        (
            ("model._partial_=false",),
            "model: missing 'layout' and 'scene_dimensions'; a setting is given as model.NAME=…, "
            "what the program gives needs `_partial_: true` beside model._target_",
        ),
    ],
)
def test_an_error_of_a_run_is_said_once_and_kept_where_the_run_is(
    words: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    status, output = run(tmp_path, *words, "run.folder=here/run")
    assert status == 1
    (line,) = [line for line in output.splitlines() if message in line]
    assert "Error executing" not in output
    assert "Traceback" not in output
    assert "full_key" not in output
    kept = (tmp_path / "here" / "run" / "train.log").read_text()
    assert line in kept
    assert "Traceback (most recent call last):" in kept  # the only way to a line of one's own class
    assert [path.name for path in tmp_path.rglob("train.log")] == ["train.log"]
    assert not (tmp_path / "outputs").exists()


FORGETFUL = """
from ngi.reuse import Never

class Forgetful(Never):
    def __init__(self, **settings): pass

    def probability(self, state, **counts):
        return state.missing
"""


def test_a_bug_ends_with_a_traceback_that_is_kept_where_the_run_is(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(FORGETFUL)
    status, output = run(tmp_path, "reuse.policy._target_=mine.Forgetful", "run.folder=here/run")
    assert status == 1
    assert "'PolicyState' object has no attribute 'missing'" in output
    kept = (tmp_path / "here" / "run" / "train.log").read_text()
    assert 'mine.py", line 8, in probability' in kept


def test_an_error_of_what_is_measured_is_said_once(tmp_path: Path) -> None:
    status, output = run_module("ngi.studies.costs", *SMALL, "seed=maybe", folder=tmp_path)
    assert status == 1
    assert output.count("seed: 'maybe' is not an integer") == 1


def test_costs_name_what_chooses_the_folder_they_write_to(tmp_path: Path) -> None:
    (tmp_path / "cache").touch()
    status, output = run_module("ngi.studies.costs", *SMALL, folder=tmp_path)
    assert status == 1
    assert f"'{tmp_path / 'cache' / 'costs'}'; choose another folder with NGI_CACHE=…" in output


def test_a_launcher_that_is_not_installed_is_told_how_to_get() -> None:
    missing = MissingConfigException("", "hydra/launcher/submitit_slurm", ["basic"])
    assert "launcher can be basic; install it with pip install " in explained(missing)
    assert "[slurm]" in explained(missing)


def test_ctrl_c_ends_a_program_without_a_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setenv("HYDRA_FULL_ERROR", "0")
    monkeypatch.setattr("sys.argv", ["ngi train"])
    with pytest.raises(SystemExit) as ended:
        run_program(interrupted)
    assert ended.value.code == 130


def test_jobs_of_a_sweep_write_where_their_folder_is(tmp_path: Path) -> None:
    words = ("seed=maybe,never", "run.folder=runs/${seed}")
    status, output = run(tmp_path, *words, options=("--multirun",))
    assert status == 1
    at_the_time, in_the_end = output.split("2 runs of this sweep failed:")
    plan, at_the_time = at_the_time.split("2 runs: 2 cannot start")
    for seed in ("maybe", "never"):
        assert plan.count(f"seed: '{seed}' is not an integer") == 1
        assert at_the_time.count(f"seed: '{seed}' is not an integer") == 1
        assert in_the_end.count(f"runs/{seed}: seed: '{seed}' is not an integer") == 1
    logs = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("train.log"))
    assert logs == ["runs/maybe/train.log", "runs/never/train.log"]
