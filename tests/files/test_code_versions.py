"""Every version of the code that a run was made with is in its record."""

import logging
import shutil
from functools import partial
from pathlib import Path

import pytest

import ngi
from ngi.files import code_versions
from ngi.files.code_versions import record_code_version
from ngi.learn import RunFolder
from ngi.machine.provenance import code_hash


def program_is(patch: pytest.MonkeyPatch, commit: str, code: str, *, dirty: bool = False) -> None:
    """Which version the program is from now on."""
    version = {"commit": commit * 40, "dirty": dirty, "code": code * 16}
    patch.setattr(code_versions, "code_version", lambda *_: version)


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch):
    return partial(program_is, monkeypatch)


def versions(folder: Path) -> list[tuple]:
    found = code_versions.code_versions(folder)
    return [(v["commit"][0], v["dirty"], v["code"][0], v["after_step"]) for v in found]


def test_every_version_is_recorded_once_and_a_change_is_warned_of(
    tmp_path: Path, caplog, program
) -> None:
    with caplog.at_level(logging.WARNING):
        program("a", "1")
        record_code_version(tmp_path, after_step=0)
        program("b", "1")  # nothing of the program has changed
        record_code_version(tmp_path, after_step=20)
        assert caplog.records == []
        program("b", "2", dirty=True)
        record_code_version(tmp_path, after_step=40)
    (warning,) = [r.getMessage() for r in caplog.records]
    assert "commit bbbbbbbbbbbb and uncommitted changes (22222222); up to step 40" in warning
    assert "made with commit aaaaaaaaaaaa. If" in warning
    assert versions(tmp_path) == [("a", False, "1", 0), ("b", True, "2", 40)]
    folder = RunFolder(tmp_path, settings={})
    result = folder.write_result({"finished": True})
    assert result["commits"] == code_versions.code_versions(tmp_path)
    folder.close()


def test_what_is_done_again_with_another_version_is_of_that_one(tmp_path: Path, program) -> None:
    """A run that goes back to before the change."""
    program("a", "1")
    record_code_version(tmp_path, after_step=0)
    program("b", "2")
    for step in (44, 50, 22):
        record_code_version(tmp_path, after_step=step)
    assert versions(tmp_path) == [("a", False, "1", 0), ("b", False, "2", 22)]


def test_a_version_that_made_no_step_made_nothing(tmp_path: Path, caplog, program) -> None:
    """Started by mistake, and stopped while references were prepared."""
    program("a", "1")
    record_code_version(tmp_path, after_step=0)
    program("b", "2")
    record_code_version(tmp_path, after_step=100)
    made = code_versions.made_with(tmp_path, last_step=100)
    assert made is not None
    assert made["commit"][0] == "a"
    caplog.clear()
    program("a", "1")
    record_code_version(tmp_path, after_step=100)
    assert caplog.records == []
    assert versions(tmp_path) == [("a", False, "1", 0)]


def test_what_makes_no_steps_was_made_with_the_last_version(tmp_path: Path, program) -> None:
    assert code_versions.made_with(tmp_path, last_step=0) is None
    program("a", "1")
    record_code_version(tmp_path, after_step=0)
    made = {**code_versions.code_version(), "after_step": 0}
    assert code_versions.made_with(tmp_path, last_step=0) == made


def test_two_states_of_one_commit_are_told_apart(tmp_path: Path, caplog, program) -> None:
    program("a", "1", dirty=True)
    record_code_version(tmp_path, after_step=0)
    record_code_version(tmp_path, after_step=10)
    assert caplog.records == []
    program("a", "2", dirty=True)
    record_code_version(tmp_path, after_step=20)
    assert len(caplog.records) == 1
    assert versions(tmp_path) == [("a", True, "1", 0), ("a", True, "2", 20)]


def test_a_start_afresh_begins_a_new_record(tmp_path: Path, program) -> None:
    for commit in "ab":
        program(commit, commit)
        record_code_version(tmp_path, after_step=0)
    assert [version["commit"][0] for version in code_versions.code_versions(tmp_path)] == ["b"]


def test_a_damaged_record_is_named(tmp_path: Path) -> None:
    (tmp_path / "commits.json").write_text("[{}]")
    with pytest.raises(ValueError, match=r"commits\.json is damaged"):
        code_versions.code_versions(tmp_path)


def test_the_hash_is_over_the_programs_modules_and_nothing_else(tmp_path: Path, monkeypatch):
    package = Path(ngi.__file__).parent
    copy = tmp_path / "ngi"
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(ngi, "__file__", str(copy / "__init__.py"))
    before = code_hash()
    (copy / "notes.txt").write_text("no module")
    (copy / "_data" / "scenes").mkdir(parents=True)
    (copy / "_data" / "scenes" / "make.py").write_text("a script beside the package, in a wheel")
    (copy / "models" / ".#loss.py").symlink_to("someone@somewhere.1234")  # Emacs, while it edits
    (copy / "models" / "gone.py").symlink_to("nowhere.py")
    assert code_hash() == before
    loss = copy / "models" / "loss.py"
    loss.write_text(loss.read_text().replace("1", "2", 1))
    changed = code_hash()
    loss.rename(copy / "models" / "losses.py")
    assert len({before, changed, code_hash()}) == 3


def test_the_last_step_of_a_log(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path, settings={})
    assert folder.steps.last_step == 0
    for step in (1, 2):
        folder.steps.append({"loss": 0.5, "step": step})
    folder.steps.flush()
    assert folder.steps.last_step == 2
    folder.close()


def test_modules_that_somebody_is_at_work_on_count_where_a_run_names_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    package = tmp_path / "own_package"
    package.mkdir()
    own = (tmp_path / "own_target.py", package / "__init__.py", package / "parts.py")
    for file in own:
        file.write_text("one = 1")
    (tmp_path / "own_other.py").write_text("one = 1")
    packages = ("own_package", "own_target")
    hashes = {code_hash(), code_hash(packages)}
    for file in own:
        file.write_text("one = 2")
        hashes.add(code_hash(packages))
    assert len(hashes) == 5
    (tmp_path / "own_other.py").write_text("one = 2")
    assert code_hash(packages) in hashes
    assert code_hash(("torch", "json", "builtins", "__main__", "nowhere")) == code_hash()


def test_what_a_run_names_is_found_in_its_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[str]] = []
    monkeypatch.setattr(code_versions, "code_hash", lambda names: asked.append(names) or "0")
    code_versions._version.cache_clear()
    target = {"_target_": "ngi.explore.Uniform", "parts": [{"_target_": "mine.Target"}, 3]}
    code_versions.code_version({"sampler": target, "loss": {"_target_": "other.a.Loss"}})
    code_versions.code_version()
    code_versions._version.cache_clear()
    assert asked == [["mine", "other"], []]
