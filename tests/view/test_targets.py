"""Where a view leads, by points all over boxes."""

from itertools import product

import numpy as np
import pytest

from ngi.view.targets import nearest_target

BOXES = {
    "ahead": ((-1, -1, 4), (1, 1, 6)),
    "flat": ((-1, -0.3, 4), (1, -0.3, 6)),
    "a line": ((0.5, 0.2, 4), (0.5, 0.2, 6)),
    "a point": ((0.5, 0.2, 4), (0.5, 0.2, 4)),
    "around": ((-1, -1, -1), (1, 1, 6)),
    "behind": ((-1, -0.5, -6), (1, 1, -4)),
}


def points_of(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    counts = np.where(low < high, 61, 1)
    axes = [np.linspace(*each) for each in zip(low, high, counts, strict=True)]
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)


def cosine(points: np.ndarray, direction: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(points, axis=-1) * np.linalg.norm(direction)
    return points @ direction / np.maximum(lengths, 1e-12)


@pytest.mark.parametrize("name", BOXES)
def test_it_is_missed_by_the_smallest_angle(name: str) -> None:
    low, high = (np.array(end, dtype=float) for end in BOXES[name])
    points = points_of(low, high)
    along_axes = [signs for signs in product((-1.0, 0.0, 1.0), repeat=3) if any(signs)]
    for direction in (*np.random.default_rng(3).normal(size=(100, 3)), *map(np.array, along_axes)):
        found = nearest_target(direction, low, high)
        assert ((found >= low - 1e-9) & (found <= high + 1e-9)).all()
        assert cosine(found, direction) >= cosine(points, direction).max() - 1e-9


@pytest.mark.parametrize("box", ["ahead", "flat", "around"])
def test_of_what_a_view_leads_through_it_is_what_is_closest_to_the_middle(box: str) -> None:
    low, high = (np.array(end, dtype=float) for end in BOXES[box])
    aims = low + (high - low) * np.random.default_rng(4).random((20, 3))
    for direction in aims[aims[:, 2] > 0]:
        found = nearest_target(direction, low, high)
        assert cosine(found, direction) == pytest.approx(1)
        along = np.linspace(0, 3, 30_001)[:, None] * direction
        inside = along[((along >= low - 1e-9) & (along <= high + 1e-9)).all(axis=1)]
        inside = np.concatenate([inside, direction[None]])
        distances = np.linalg.norm(inside - (low + high) / 2, axis=1)
        assert np.linalg.norm(found - (low + high) / 2) <= distances.min() + 1e-6


def test_a_view_without_a_direction_has_the_closest_point() -> None:
    low, high = (np.array(end, dtype=float) for end in BOXES["ahead"])
    assert nearest_target(np.zeros(3), low, high).tolist() == [0, 0, 4]
