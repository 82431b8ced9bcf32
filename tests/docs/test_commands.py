"""Every command that README and documentation show can be given."""

import re
import shlex
import subprocess
from collections.abc import Iterator
from dataclasses import fields
from importlib import import_module
from importlib.util import find_spec
from itertools import product
from os.path import relpath
from pathlib import Path

import pytest

from ngi.cli import VERBS
from ngi.config.command_words import completed
from ngi.config.configuration import composed
from tests.config.command_line import composed as known_to_hydra
from tests.docs.pages import ROOT, commands

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
SHOWN = [(page, command) for page in PAGES for command in commands(page) if "ngi" in command]
OPTIONS = {
    "view": ("ngi.view.__main__", "ViewOptions"),
    "render": ("ngi.view.picture", "PictureOptions"),
    "video": ("ngi.view.video", "VideoOptions"),
    "export": ("ngi.view.export", "ExportOptions"),
}
OPENED = r"\brun=(outputs/\S+)"
OF_A_TUTORIAL = {"scene=lamp", "sampler=loss_power", "sampler=shrinking"}


def words_of(command: str, verb: str) -> list[str] | None:
    """What follows `ngi VERB`; None where the command is another one."""
    words = [word for word in shlex.split(command) if not re.fullmatch(r"[A-Z_]+=\S*", word)]
    return words[2:] if words[:2] == ["ngi", verb] else None


def given(verb: str) -> Iterator[tuple[Path, str]]:
    for page, command in SHOWN:
        if words_of(command, verb) is not None:
            yield page, command


def overrides(words: list[str]) -> Iterator[list[str]]:
    """Those of each job of a sweep, or of the one run."""
    plain = [word for word in words if "=" in word and not word.startswith("-")]
    sweeping = "-m" in words
    choices = [
        [f"{key}={value}" for value in values.split(",")] if sweeping and "[" not in values
        else [word]
        for word in plain
        for key, _, values in [word.partition("=")]
    ]  # fmt: skip
    return map(list, product(*choices))


def test_commands_are_shown() -> None:
    assert len(SHOWN) > 50


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_verbs_modules_and_targets_exist(page: Path) -> None:
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    for command in commands(page):
        if match := re.match(r"(?:[A-Z_]+=\S* )?ngi (\w[\w-]*)", command):
            assert match[1] in VERBS, command
        elif match := re.search(r"python -m ((?:ngi|analysis|tests)[\w.]*)", command):
            assert find_spec(match[1]), command
        elif match := re.match(r"make (\w+)", command):
            assert match[1] in targets, command


@pytest.mark.parametrize(
    "command", sorted({c for verb in ("train", "costs") for _, c in given(verb)})
)
def test_configurations_can_be_composed(command: str) -> None:
    words = words_of(command, "train") or words_of(command, "costs") or []
    if "--config-dir" in words or OF_A_TUTORIAL & {*words}:
        pytest.skip("a tutorial's own; run by test_tutorials")
    for job in overrides(words):
        composed(*job)


@pytest.mark.parametrize("verb", OPTIONS)
def test_options_are_those_of_the_verb(verb: str) -> None:
    module, name = OPTIONS[verb]
    known = {field.name for field in fields(getattr(import_module(module), name))}
    shown = [command for _, command in given(verb)]
    assert shown
    for command in shown:
        keys = {word.partition("=")[0] for word in words_of(command, verb) or [] if "=" in word}
        assert keys <= known, command


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_run_that_is_opened_lies_where_training_has_put_it(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a command of the same page, or by `make demo`; a tutorial's own is opened by its test."""
    opening = [command for command in commands(page) if "NGI_TRUSTED" not in command]
    shown = {folder for command in opening for folder in re.findall(OPENED, command)}
    if not shown:
        return
    (tmp_path / "lamp").mkdir()  # the tutorial's scene
    (tmp_path / "lamp" / "scene.yaml").touch()
    monkeypatch.setenv("NGI_SCENES", str(tmp_path))
    trained = [words for c in commands(page) if (words := words_of(c, "train")) is not None]
    jobs = [job for words in trained if "--config-dir" not in words for job in overrides(words)]
    methods = ("ours", "uniform", "active_exploration")
    jobs += [["+sweeps=demo", f"method={name}"] for name in methods]
    folders = {relpath(known_to_hydra(*completed(job)).run.folder) for job in jobs}
    assert shown <= folders


def test_only_the_runs_of_a_report_are_launched_elsewhere() -> None:
    """Costs are measured here; options of another launcher would be refused."""
    options = "hydra/launcher=joblib hydra.launcher.n_jobs=4 seed=0"
    command = ["make", "--dry-run", "--no-print-directory", "report", f"OPTIONS={options}"]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    costs, runs = (
        re.search(rf"{program} -m [^;&|]*", said.replace("\\\n", ""))
        for program in ("ngi costs", "ngi.train")
    )
    assert costs is not None
    assert runs is not None
    assert costs[0].split()[-2:] == ["hydra/launcher=basic", "seed=0"]
    assert runs[0].split()[-3:] == options.split()
