"""Every version of the code that a run was made with is in its record, and a change is said."""

import logging
from functools import partial
from pathlib import Path

import pytest

from ngi.learn import RunFolder
from ngi.learn.code_versions import code_versions, record_code_version


def test_every_version_is_recorded_once_and_a_change_is_warned_of(tmp_path: Path, caplog) -> None:
    record = partial(record_code_version, tmp_path)
    with caplog.at_level(logging.WARNING):
        record(commit="a" * 40, dirty=False, after_step=0)
        record(commit="a" * 40, dirty=False, after_step=20)
        assert caplog.records == []
        record(commit="b" * 40, dirty=True, after_step=40)
    (warning,) = [r.getMessage() for r in caplog.records]
    assert "goes on with commit bbbbbbbbbbbb and uncommitted changes; up to step 40" in warning
    assert "made with commit aaaaaaaaaaaa." in warning
    versions = [(v["commit"][0], v["dirty"], v["after_step"]) for v in code_versions(tmp_path)]
    assert versions == [("a", False, 0), ("b", True, 40)]
    folder = RunFolder(tmp_path, settings={})
    assert folder.write_result({"finished": True})["commits"] == code_versions(tmp_path)
    folder.close()


def test_a_start_afresh_begins_a_new_record(tmp_path: Path) -> None:
    record_code_version(tmp_path, commit="a", dirty=False, after_step=0)
    record_code_version(tmp_path, commit="b", dirty=False, after_step=0)
    assert [version["commit"] for version in code_versions(tmp_path)] == ["b"]


def test_a_damaged_record_is_named(tmp_path: Path) -> None:
    (tmp_path / "commits.json").write_text("[{}]")
    with pytest.raises(ValueError, match=r"commits\.json is damaged"):
        code_versions(tmp_path)


def test_the_last_step_of_a_log(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path, settings={})
    assert folder.steps.last_step == 0
    for step in (1, 2):
        folder.steps.append({"loss": 0.5, "step": step})
    folder.steps.flush()
    assert folder.steps.last_step == 2
    folder.close()
