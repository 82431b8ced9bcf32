"""`ngi VERB`: one way in, quick to answer, with errors that name the command."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import ngi
from ngi.cli import VERBS, main
from ngi.config.unread_output import readers_may_leave
from tests.learn.command_line import run_module

ROOT = Path(__file__).parents[1]
OF_HYDRA = ("train", "costs")


@pytest.fixture(autouse=True)
def own_arguments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["pytest"])


@pytest.mark.parametrize("word", ["--help", "-h", "help"])
def test_help_shows_the_way(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([word]) == 0
    lines = capsys.readouterr().out.splitlines()
    shown = [line.split()[0] for line in lines if line[:2] == "  " and line.split()[0] in VERBS]
    assert shown == list(VERBS)
    assert max(map(len, lines)) <= 80


def test_help_and_a_wrong_verb_wait_for_nothing() -> None:
    code = (
        "import sys; from ngi.cli import main; main(['--help']); main(['tran'])\n"
        "slow = ('torch', 'mitsuba', 'hydra', 'pandas', 'numpy')\n"
        "print([name for name in slow if name in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert answer.stdout.splitlines()[-1] == "[]", answer.stderr


def test_without_a_verb_the_way_is_shown_as_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert "ngi VERB --help" in capsys.readouterr().err


def test_a_wrong_verb_names_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trian", "scene=mirror"]) == 2
    assert "no 'trian'; did you mean 'ngi train'?" in capsys.readouterr().err


def unread(*words: str, unbuffered: bool) -> tuple[int, str]:
    """Status and messages of a module's command whose output nobody reads."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
    if unbuffered:
        environment["PYTHONUNBUFFERED"] = "1"
    reading, writing = os.pipe()
    os.close(reading)
    try:
        answer = subprocess.run(
            [sys.executable, "-m", *words],
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env=environment,
        )
    finally:
        os.close(writing)
    return answer.returncode, answer.stderr


@pytest.mark.parametrize("unbuffered", [False, True])
@pytest.mark.parametrize(
    "words",
    [
        ("ngi", "train", "--help"),  # Hydra prints it
        ("ngi.train", "--help"),
        ("ngi", "describe", "--help"),
        ("ngi", "describe", "mirror", "backend=scalar"),
        ("ngi", "train", "scene=mirror", "--dry-run"),
    ],
    ids=" ".join,
)
def test_a_reader_that_has_seen_enough_is_told_nothing(
    words: tuple[str, ...], unbuffered: bool
) -> None:
    """As of `ngi train --help | head`."""
    assert unread(*words, unbuffered=unbuffered) == (1, "")


def test_help_by_argparse_that_nobody_reads_says_nothing_either() -> None:
    """It swallows the error itself; unbuffered nothing is left to fail."""
    assert unread("ngi", "gpu-check", "--help", unbuffered=False) == (1, "")
    assert unread("ngi", "gpu-check", "--help", unbuffered=True) == (0, "")


def test_a_pipe_that_breaks_elsewhere_is_an_error() -> None:
    with pytest.raises(BrokenPipeError, match="a worker"), readers_may_leave():
        raise BrokenPipeError("a worker")


def test_a_process_without_an_output_prints_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    assert main(["--version"]) == 0


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"ngi {ngi.__version__}\n"


@pytest.mark.parametrize("verb", sorted(VERBS.keys() - {*OF_HYDRA}))
def test_a_verb_shows_its_own_help(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main([verb, "--help"])
    assert stopped.value.code == 0
    assert f"ngi {verb}" in capsys.readouterr().out.splitlines()[0]


def test_help_is_there_before_what_the_work_needs_is_imported() -> None:
    """In a fifth of a second; where every option of a configuration is listed Hydra is needed."""
    verbs = sorted(VERBS.keys() - {*OF_HYDRA})
    program = (
        "import contextlib, sys; from ngi.cli import main\n"
        f"for verb in {verbs}:\n"
        "    with contextlib.suppress(SystemExit): main([verb, '--help'])\n"
        "    found = {'torch', 'mitsuba', 'matplotlib', 'pandas', 'hydra'} & sys.modules.keys()\n"
        "    assert not found, (verb, found)"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr


@pytest.mark.parametrize("verb", OF_HYDRA)
def test_so_do_those_of_hydra(verb: str, tmp_path: Path) -> None:
    status, output = run_module("ngi", verb, "--help", folder=tmp_path)
    assert status == 0, output
    assert f"ngi {verb} -m +sweeps=" in output
    assert "== Groups" in output


@pytest.mark.parametrize("verb", ["view", "render", "video", "export"])
def test_a_mistake_is_answered_by_the_command(
    verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        main([verb, "rnu=FOLDER"])
    assert stopped.value.code == 2
    assert f"ngi {verb}: 'rnu' is no option" in capsys.readouterr().err


def test_a_verb_gets_its_arguments_and_gives_its_status(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["report", str(tmp_path)]) == 1
    assert str(tmp_path) in capsys.readouterr().err


def test_training_takes_the_same_words(tmp_path: Path) -> None:
    words = ("train", "--cfg", "job", "budget=smoke", "scene=mirror")
    status, output = run_module("ngi", *words, folder=tmp_path)
    assert status == 0, output
    assert "name: mirror" in output


def test_a_wrong_option_of_training_is_an_error() -> None:
    command = [sys.executable, "-m", "ngi", "train", "sampler=no_such"]
    answer = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert answer.returncode == 1
    assert "sampler/no_such: there is no such option" in answer.stderr
