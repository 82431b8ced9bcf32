"""Frames of v for scenes whose author chose none."""

from __future__ import annotations

from scipy.stats import qmc

from ngi.scene.yaml_keys import Vector

HARD_FRAMES, PATH_FRAMES = 10, 6


def spread_frames(count: int, dimensions: int) -> tuple[Vector, ...]:
    """Points of v spread evenly over the hypercube: a Halton sequence, always the same."""
    points = qmc.Halton(dimensions, seed=2022).random(count)
    return tuple(tuple(point) for point in points.round(4).tolist())
