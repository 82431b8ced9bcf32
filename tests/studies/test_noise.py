from math import sqrt
from pathlib import Path

import pytest

from tests.learn.command_line import SMALL, run, run_module

KNOWN = ("model._target_=tests.studies.known_radiance.KnownRadiance", "loss.dssim_weight=0")


def noise(folder: Path, *overrides: str) -> tuple[int, str]:
    return run_module("ngi.studies.noise", *SMALL, *overrides, "run.folder=run", folder=folder)


def parts(folder: Path, *overrides: str) -> dict[str, int]:
    """Of a small run: in percent, by the states' names."""
    status, output = run(folder, *overrides, "run.folder=run")
    assert status == 0, output
    status, output = noise(folder, *overrides)
    assert status == 0, output
    rows = [line.split("|")[1:-1] for line in output.splitlines() if line.startswith("| ")][1:]
    found = {name.strip(): int(part.strip().rstrip("%")) for name, _, _, part in rows}
    assert found.keys() == {"where the chains stand", "what they propose", "uniform"}
    return found


def test_without_noise_all_can_be_learnt(tmp_path: Path) -> None:
    assert set(parts(tmp_path).values()) == {0}


def test_a_network_that_knows_the_truth_keeps_what_is_left_of_the_noise(tmp_path: Path) -> None:
    """A mean absolute error is in proportion to the noise: of 32 times the samples, 1 / √32."""
    found = parts(tmp_path, *KNOWN, "+renderer.noise=0.05", "+renderer.samples_per_pixel=4")
    expected = 100 * (1 - 1 / sqrt(32))
    assert found == pytest.approx(dict.fromkeys(found, expected), abs=2)


def test_a_run_that_is_not_there_is_named(tmp_path: Path) -> None:
    status, output = noise(tmp_path)
    assert status != 0
    assert "run/last.ckpt does not exist" in output
