import errno
import fcntl
import hashlib
import json
from pathlib import Path
from typing import Any

import pytest

from ngi.files.run_folder import RunFolder

SETTINGS: dict[str, Any] = {"model": {"hidden_features": 64}, "seed": 0, "scene": {"hash": "abc"}}


def test_same_settings_same_identity_in_any_order(tmp_path: Path) -> None:
    first = RunFolder(tmp_path / "a", settings=SETTINGS)
    second = RunFolder(tmp_path / "b", settings=dict(reversed(SETTINGS.items())))
    other = RunFolder(tmp_path / "c", settings={**SETTINGS, "seed": 1})
    assert first.identity == second.identity != other.identity
    for folder in (first, second, other):
        folder.close()


def test_another_run_is_refused_and_nothing_is_touched(tmp_path: Path) -> None:
    first = RunFolder(tmp_path, settings=SETTINGS)
    first.begin()
    first.write_result({"finished": True})
    first.close()
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    changed = {**SETTINGS, "model": {"hidden_features": 128}}
    with pytest.raises(ValueError, match=r"model\.hidden_features: 64 there, 128 now"):
        RunFolder(tmp_path, settings=changed)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before
    again = RunFolder(tmp_path, settings=SETTINGS)  # the refusal holds no lock
    assert again.result == {"finished": True, "commits": [], "logs": {}}
    again.close()


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("mine", "mine"),
        ("outputs/small/mirror/default/seed=0", "mirror/default/seed=0"),
        ("{here}/runs/mine", "runs/mine"),
        ("../beside/mine", "../beside/mine"),
    ],
)
def test_its_name_is_of_the_folder_and_not_of_those_above(
    path: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    folder = RunFolder(Path(path.format(here=Path.cwd())), settings=SETTINGS)
    assert folder.name == name
    folder.close()


def test_two_processes_can_not_train_one_run(tmp_path: Path) -> None:
    first = RunFolder(tmp_path, settings=SETTINGS)
    with pytest.raises(RuntimeError, match="another process"):
        RunFolder(tmp_path, settings=SETTINGS)
    first.close()


def test_a_disk_that_knows_no_locks_is_named(tmp_path: Path, monkeypatch) -> None:
    def unknown(*_: object) -> None:
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr(fcntl, "flock", unknown)
    with pytest.raises(OSError, match=r"this disk cannot lock files, .*run\.folder=…"):
        RunFolder(tmp_path, settings=SETTINGS)


@pytest.mark.parametrize("place", ["below a file", "in /proc"])
def test_a_folder_that_can_not_be_written_to_is_named(tmp_path: Path, place: str) -> None:
    """As root too, whom no permissions bind."""
    (tmp_path / "file").touch()
    path = tmp_path / "file" / "run" if place == "below a file" else Path("/proc/run")
    with pytest.raises(OSError, match=rf"is not writable; .*run\.folder=….*'{path}'"):
        RunFolder(path, settings=SETTINGS)


def test_damaged_result_is_named(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path, settings=SETTINGS)
    folder.write_result({"finished": True})
    (tmp_path / "result.json").write_text(json.dumps({"finished": True})[:-3])
    with pytest.raises(ValueError, match=r"result\.json is damaged"):
        _ = folder.result
    folder.close()


def test_unfinished_run_has_no_result(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path, settings=SETTINGS)
    assert folder.result is None
    folder.close()


def test_a_start_that_failed_early_does_not_claim_the_folder(tmp_path: Path) -> None:
    failed = RunFolder(tmp_path, settings=SETTINGS)
    failed.begin()
    failed.close()
    mended = RunFolder(tmp_path, settings={**SETTINGS, "seed": 3})
    mended.begin()
    mended.checkpoint.write_bytes(b"")
    mended.close()
    with pytest.raises(ValueError, match="seed: 3 there, 0 now"):
        RunFolder(tmp_path, settings=SETTINGS)


def test_a_number_written_otherwise_is_the_run_that_checkpoints_know(tmp_path: Path) -> None:
    """`optimizer.lr=1` and `1.0`, which JSON keeps apart and settings do not."""
    first = RunFolder(tmp_path, settings={**SETTINGS, "lr": 1, "budget": {"steps": 4, "spp": 8}})
    first.begin()
    first.checkpoint.write_bytes(b"")
    first.close()
    for steps in (4, 8, 16):
        budget = {"steps": steps, "spp": 8.0}
        again = RunFolder(tmp_path, settings={**SETTINGS, "lr": 1.0, "budget": budget})
        again.begin()
        again.close()
        assert again.identity == first.identity
        assert again.settings["budget"]["steps"] == steps


def test_damaged_settings_are_named(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path, settings=SETTINGS)
    folder.begin()
    folder.write_result({})
    folder.close()
    (tmp_path / "settings.json").write_text("{")
    with pytest.raises(ValueError, match=r"settings\.json is damaged"):
        RunFolder(tmp_path, settings=SETTINGS)


def test_the_result_holds_length_and_checksum_of_every_log(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path, settings=SETTINGS)
    folder.steps.append({"step": 1, "loss": 0.5})
    folder.chains.append({"step": 1})
    written = folder.write_result({"finished": True})
    assert folder.result == written
    folder.close()
    for name in ("steps.csv", "chains.bin"):
        content = (tmp_path / name).read_bytes()
        expected = {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
        assert written["logs"][name] == expected
    assert written["logs"].keys() == {"steps.csv", "chains.bin"}
