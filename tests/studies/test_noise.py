from pathlib import Path

import pytest

from tests.learn.command_line import SMALL, run, run_module


def noise(folder: Path, *overrides: str) -> tuple[int, str]:
    return run_module("ngi.studies.noise", *SMALL, *overrides, "run.folder=run", folder=folder)


@pytest.mark.parametrize("deviation", [0, 3])
def test_noise_is_told_from_what_can_be_learnt(tmp_path: Path, deviation: int) -> None:
    status, output = run(tmp_path, f"+renderer.noise={deviation}", "run.folder=run")
    assert status == 0, output
    status, output = noise(tmp_path, f"+renderer.noise={deviation}")
    assert status == 0, output
    rows = [line.split("|")[1:-1] for line in output.splitlines() if line.startswith("| ")][1:]
    parts = {name.strip(): int(part.strip().rstrip("%")) for name, _, _, part in rows}
    assert parts.keys() == {"where the chains stand", "what they propose", "uniform"}
    if deviation:
        assert all(part > 10 for part in parts.values())
    else:
        assert set(parts.values()) == {0}


def test_a_run_that_is_not_there_is_named(tmp_path: Path) -> None:
    status, output = noise(tmp_path)
    assert status != 0
    assert "run/last.ckpt is not there" in output
