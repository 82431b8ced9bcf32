from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.runs import Run
from analysis.target_map import (
    PATCHES_PER_CELL,
    histogram_distances,
    warnings_of_maps,
    windows,
)
from tests.analysis.traces import CHAINS, write_maps, write_trace

CELLS = 8
STEPS = [100, 250]
DENSITY = np.outer(np.arange(1.0, CELLS + 1) ** 2, np.full(CELLS, 3.0))
"""Rises along the first variable, is the same along the second."""


def states_from(density: np.ndarray, count: int, seed: int) -> np.ndarray:
    """[count, 4] independent states, uniform within the cells."""
    generator = np.random.default_rng(seed)
    cell = generator.choice(density.size, size=count, p=(density / density.sum()).ravel())
    corner = np.stack(np.unravel_index(cell, density.shape), axis=-1)
    v = (corner + generator.random((count, 2))) / CELLS
    return np.concatenate([v, generator.random((count, 2))], axis=1)


def make(folder: Path, density: np.ndarray, *, seed: int = 0) -> Run:
    """A run whose chains draw independently from `density`, whatever its map, `DENSITY`, says."""
    folder.mkdir()
    position = states_from(density, STEPS[-1] * CHAINS, seed).reshape(-1, CHAINS, 4)
    write_trace(folder, position, np.ones(position.shape[:2], dtype=bool))
    write_maps(folder, DENSITY, STEPS)
    return Run(folder, {"label": {"scene": "mirror"}, "seed": seed}, None, "method")  # type: ignore[arg-type]


def test_the_windows_hold_the_states_since_the_last_map(tmp_path: Path) -> None:
    first, second = windows(make(tmp_path / "run", DENSITY))
    assert (first.counts.sum(), second.counts.sum()) == (100 * CHAINS, 150 * CHAINS)
    assert (first.step, second.step, second.run_seconds) == (100, 250, 500.0)
    np.testing.assert_allclose(second.density, DENSITY / DENSITY.sum(), rtol=1e-6)
    # The first index is the first variable, as in the map: 1², 2², … along it.
    expected = np.arange(1.0, CELLS + 1) ** 2 / 204
    np.testing.assert_allclose(second.counts.sum(axis=(0, 2)) / 2400, expected, atol=0.03)
    np.testing.assert_allclose(second.counts.sum(axis=(0, 1)) / 2400, 1 / CELLS, atol=0.03)


SQUARES = np.arange(1.0, CELLS + 1) ** 2
FOLLOWED = CELLS * (SQUARES @ SQUARES) / SQUARES.sum() ** 2
"""Mean of DENSITY over states of DENSITY, by its mean over uniform ones: 8 Σ i⁴ / (Σ i²)²."""


@pytest.mark.parametrize(
    ("density", "gain"),
    [
        (DENSITY, FOLLOWED),
        (np.ones((CELLS, CELLS)), 1.0),
        (DENSITY[::-1], CELLS * (SQUARES @ SQUARES[::-1]) / SQUARES.sum() ** 2),
    ],
    ids=["target", "uniform", "opposite"],
)
def test_the_gain_is_the_target_density_that_the_states_have(
    tmp_path: Path, density: np.ndarray, gain: float
) -> None:
    runs = [make(tmp_path / str(seed), density, seed=seed) for seed in range(4)]
    table = histogram_distances(runs)
    assert table["step"].tolist() == STEPS * 4
    assert set(table["scene"]) == {"mirror"}
    assert table["gain"].mean() == pytest.approx(gain, abs=0.03)
    assert table["gain_of_target"].unique() == pytest.approx([FOLLOWED])
    deviation = np.sqrt(np.square(table["gain"] - gain).mean())
    assert 0.4 < deviation / table["gain_error"].mean() < 2
    assert (table["floor"] < table["uniform_distance"]).all()
    first, second = (table[table["step"] == step] for step in STEPS)
    assert first["floor"].iloc[0] > second["floor"].iloc[0]  # of fewer states


@pytest.mark.parametrize(
    ("density", "column"),
    [(DENSITY, "floor"), (np.ones((CELLS, CELLS)), "uniform_distance")],
    ids=["target", "uniform"],
)
def test_independent_states_are_as_far_from_the_target_as_expected(
    tmp_path: Path, density: np.ndarray, column: str
) -> None:
    runs = [make(tmp_path / str(seed), density, seed=seed) for seed in range(4)]
    of_steps = histogram_distances(runs).groupby("step")
    found, expected = of_steps["distance"].mean(), of_steps[column].mean()
    np.testing.assert_allclose(found, expected, rtol=0.15)


def test_a_histogram_beside_its_target_has_distance_1(tmp_path: Path) -> None:
    run = make(tmp_path / "run", np.eye(CELLS))
    (run.folder / "target_map.bin").unlink()
    write_maps(run.folder, np.eye(CELLS)[::-1], STEPS)
    assert histogram_distances([run])["distance"].tolist() == pytest.approx([1, 1])


def test_patch_positions_are_compared_on_their_own(tmp_path: Path) -> None:
    run = make(tmp_path / "run", DENSITY)  # patch positions are uniform, the map's rise with x
    last = windows(run, "patch")[-1]
    cells = len(last.density)
    assert last.density.size <= CELLS * CELLS * 16 / PATCHES_PER_CELL
    rise = (2 * np.arange(cells) + 1) / cells**2
    np.testing.assert_allclose(last.density.sum(axis=1), rise, atol=0.03)
    np.testing.assert_allclose(
        last.counts.sum(axis=(0, 2)) / last.counts.sum(), 1 / cells, atol=0.03
    )
    assert histogram_distances([run], "patch")["gain"].iloc[-1] == pytest.approx(1, abs=0.1)


def test_correlation_within_a_chain_is_no_gain(tmp_path: Path) -> None:
    """Chains that hold every state of the target for ten batches: fewer, but the same states."""
    tables = []
    for seed in range(6):
        run = make(tmp_path / str(seed), DENSITY, seed=seed)
        moved = np.zeros((STEPS[-1], CHAINS), dtype=bool)
        moved[::10] = True
        (run.folder / "chains.bin").unlink()
        position = states_from(DENSITY, moved.size, seed).reshape(-1, CHAINS, 4)
        write_trace(run.folder, position, moved)
        tables.append(histogram_distances([run]))
    table = pd.concat(tables)
    assert table["distance"].mean() > 1.5 * table["floor"].mean()  # what the distance would say
    assert table["gain"].mean() == pytest.approx(FOLLOWED, abs=0.05)
    assert 0.5 < table["gain"].std() / table["gain_error"].mean() < 2


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("plane", ["scene", "patch"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_the_distance_from_a_map_that_is_no_density_is_not_known(
    tmp_path: Path, value: float, plane: str
) -> None:
    good, run = (make(tmp_path / name, DENSITY) for name in ("good", "bad"))
    (run.folder / "target_map.bin").unlink()
    write_maps(run.folder, DENSITY, STEPS[:1])
    bad = np.vstack([DENSITY[:-1], np.full((1, CELLS), value)]) if value else 0 * DENSITY
    write_maps(run.folder, bad, STEPS[1:])
    table, expected = (histogram_distances([one], plane) for one in (run, good))
    pd.testing.assert_frame_equal(table.iloc[:1], expected.iloc[:1])
    of_the_chains = ["scene", "method", "seed", "step", "run_seconds", "states"]
    pd.testing.assert_frame_equal(table[of_the_chains], expected[of_the_chains])
    assert table.iloc[1].drop(of_the_chains).isna().all()
    (warning,) = warnings_of_maps([good, run])
    assert warning.startswith("1 run(s) have target maps that are not finite, or 0 everywhere")
    assert warning.endswith(f": {run.folder}")


@pytest.mark.parametrize("file", ["chains.bin", "target_map.bin"])
def test_runs_without_map_or_trace_have_no_rows(tmp_path: Path, file: str) -> None:
    run = make(tmp_path / "run", DENSITY)
    (run.folder / file).unlink()
    table = histogram_distances([run])
    assert table.empty
    assert warnings_of_maps([run]) == []
    assert {"scene", "method", "seed", "step", "run_seconds", "distance"} < set(table.columns)
