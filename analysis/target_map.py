"""Where chains go against where their target density is high, in scenes of two variables.

The paper compares both by eye (Fig. 6); here they get a distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isqrt

import numpy as np
import pandas as pd
from scipy.spatial.distance import jensenshannon

from analysis.chain_trace import read_chain_trace
from analysis.records import read_records
from analysis.runs import Run

SIMULATIONS = 200
"""Of an equal number of independent states, for the distance that noise alone causes."""

PLANES = {"scene": [0, 1], "patch": [2, 3]}
"""The coordinates of a state, (v, patch position), that span each."""

PATCHES_PER_CELL = 32
"""Of the map, where the patch position is divided into cells."""

COLUMNS = (
    "scene",
    "method",
    "seed",
    "step",
    "run_seconds",
    "states",
    "distance",
    "floor",
    "uniform_distance",
    "gain",
    "gain_error",
    "gain_of_target",
)


@dataclass(frozen=True)
class Window:
    """The time between two evaluations, of which the later one measured the target density.

    step, run_seconds: at its end
    density: [g, g] target density at its end; sums up to 1, or is NaN throughout
    counts: [n, g, g] how often each of n chains stood in a cell, after every generated batch
    The first index is the cell along the first scene variable.
    """

    step: int
    run_seconds: float
    density: np.ndarray
    counts: np.ndarray


def windows(run: Run, plane: str = "scene") -> list[Window]:
    """One per evaluation; none for a run without a map or a trace.

    plane: 'scene' for the two scene variables, on the grid of the map, or 'patch' for the patch
        position, on a grid whose cells hold `PATCHES_PER_CELL` of the map's patches on average
    """
    maps = read_records(run.folder / "target_map.bin")
    if maps is None:
        return []
    trace = read_chain_trace(run)
    if trace is None or trace.state is None:
        return []
    patches = maps["target"][0].size
    cells = maps["target"].shape[1] if plane == "scene" else isqrt(patches // PATCHES_PER_CELL)
    found, begin = [], 0
    for record in maps:
        end = int(np.searchsorted(trace.step, record["step"], side="right"))
        states = trace.state[begin:end].swapaxes(0, 1)  # [n, T, 4]
        if states.size:
            found.append(
                Window(
                    step=int(record["step"]),
                    run_seconds=float(record["run_seconds"]),
                    density=_density(record, plane, cells),
                    counts=np.stack([_histogram(_coordinates(s, plane), cells) for s in states]),
                )
            )
        begin = end
    return found


def warnings_of_maps(runs: Sequence[Run]) -> list[str]:
    """A line that names the runs of which a map is no density, if there are any."""
    maps = [(run.folder, read_records(run.folder / "target_map.bin")) for run in runs]
    unknown = [
        str(folder)
        for folder, records in maps
        if records is not None and not all(map(_is_density, records["target"]))
    ]
    if not unknown:
        return []
    return [
        f"{len(unknown)} run(s) have target maps that are not finite, or 0 everywhere, so that how "
        f"closely chains follow them is not known: {', '.join(unknown)}"
    ]


def _is_density(target: np.ndarray) -> bool:
    """Whether target densities of a map's patches can be made to sum up to 1."""
    return bool(np.isfinite(target).all() and target.any())


def _coordinates(states: np.ndarray, plane: str) -> np.ndarray:
    """[n, 2] the two coordinates of states [..., 4] that span the plane."""
    return states.reshape(-1, 4)[:, PLANES[plane]]


def _density(record: np.void, plane: str, cells: int) -> np.ndarray:
    """[cells, cells] mean target density of the map's patches in each cell, summing up to 1.

    NaN throughout where the map is no density.
    """
    states, target = _coordinates(record["state"], plane), record["target"].ravel()
    if not _is_density(target):
        return np.full((cells, cells), np.nan)
    mean = _histogram(states, cells, target) / np.maximum(_histogram(states, cells), 1)
    density: np.ndarray = mean / mean.sum()
    return density


def _histogram(states: np.ndarray, cells: int, weights: np.ndarray | None = None) -> np.ndarray:
    edges = [np.linspace(0, 1, cells + 1)] * 2
    counts: np.ndarray = np.histogram2d(states[:, 0], states[:, 1], bins=edges, weights=weights)[0]
    return counts


def histogram_distances(runs: Sequence[Run], plane: str = "scene") -> pd.DataFrame:
    """A row per run and window: how far the chains' histogram is from the target density.

    plane: 'scene' for the two scene variables or 'patch' for the patch position

    distance: Jensen-Shannon distance with logarithms to base 2: 0 for equal distributions, 1 for
        those that share no cell
    states: how many the histogram holds
    floor: expected distance of as many independent states drawn from the target density itself.
        Those of a chain are correlated, so that even one that follows its target stays above it.
    uniform_distance: expected distance of as many uniformly drawn independent states
    gain: mean target density where the chains stood, by its mean over the hypercube: 1 for uniform
        sampling. Neither the number of states nor their correlation adds to it, so that it tells
        something where the target is nearly uniform and the distance does not.
    gain_error: its standard error, from the chains' own gains
    gain_of_target: that of independent states of the target density; chains above it are even more
        often where it is high
    All but `states` are NaN where the map is no density.
    """
    rows = []
    for run in runs:
        for window in windows(run, plane):
            counts = window.counts.sum(axis=0)
            states = int(counts.sum())
            even = np.full_like(window.density, 1 / window.density.size)
            rows.append(
                (
                    *(run.scene, run.method, run.seed, window.step, window.run_seconds, states),
                    float(_distances(counts, window.density)),
                    _expected_distance(window.density, window.density, states),
                    _expected_distance(even, window.density, states),
                    *_gain(window),
                )
            )
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _distances(counts: np.ndarray, density: np.ndarray) -> np.ndarray:
    """Of histograms [..., g, g] from a density [g, g]; [...]."""
    flat = counts.reshape(*counts.shape[:-2], -1)
    return np.asarray(jensenshannon(flat, density.reshape(*[1] * (flat.ndim - 1), -1), 2, axis=-1))


def _expected_distance(drawn_from: np.ndarray, density: np.ndarray, states: int) -> float:
    """Mean distance from `density` of histograms of independent states; NaN from NaN."""
    if np.isnan(density).any():
        return np.nan
    generator = np.random.default_rng(0)
    counts = generator.multinomial(states, drawn_from.ravel(), size=SIMULATIONS)
    return float(_distances(counts.reshape(-1, *density.shape), density).mean())


def _gain(window: Window) -> tuple[float, float, float]:
    """The chains', its standard error, and the target's."""
    relative = window.density * window.density.size
    gains = (window.counts * relative).sum(axis=(1, 2)) / window.counts.sum(axis=(1, 2))
    error = gains.std(ddof=1) / np.sqrt(len(gains)) if len(gains) > 1 else np.nan
    return float(gains.mean()), float(error), float(np.square(relative).mean())
