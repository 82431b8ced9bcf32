"""The camera path and the hard frames of the living room, by the names of their variables.

What a frame does not name is drawn at random, from a seed of its own (variables.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

Frame = Mapping[str, float | Sequence[float]]
"""Components in [0, 1] by variable, for example {"camera.look_at": [0, 0.5, 1, 0.3, 0.2]}."""

VIEW, GLOSS = "camera.look_at", "floor_boards.roughness"
SUN, LAMP, PENDANTS = "sun.direction", "floor_lamp_globe.intensity", "pendant_left.radiance"

CAMERA_PATH: list[Frame] = [
    {VIEW: [0.5, 0.5, 1.0, 0.5, 0.4], SUN: [0.3, 0.2], GLOSS: 0.2},
    {VIEW: [0.2, 0.7, 0.9, 0.8, 0.3], SUN: [0.5, 0.4], GLOSS: 0.1},
    {VIEW: [0.0, 0.4, 0.8, 1.0, 0.5], SUN: [0.7, 0.6], GLOSS: 0.05},
    {VIEW: [0.3, 0.3, 0.3, 0.4, 0.1], SUN: [0.8, 0.3], GLOSS: 0.3},
    {VIEW: [0.7, 0.6, 0.4, 0.1, 0.2], SUN: [0.5, 0.1], GLOSS: 0.2},
    {VIEW: [1.0, 0.8, 0.6, 0.0, 0.5], SUN: [0.2, 0.5], GLOSS: 0.1},
    {VIEW: [0.9, 0.3, 1.0, 0.3, 0.4], SUN: [0.1, 0.8], GLOSS: 0.4},
    {VIEW: [0.6, 0.5, 0.9, 0.6, 0.2], SUN: [0.3, 0.3], GLOSS: 0.2},
]

HARD_FRAMES: list[tuple[str, Frame]] = [
    (
        "the low sun reaches across a shiny floor",
        {VIEW: [0.9, 0.3, 0.7, 0.0, 0.6], SUN: [0.5, 0.0], GLOSS: 0.05},
    ),
    (
        "the window mirrored in the floor",
        {VIEW: [1.0, 0.1, 0.3, 0.1, 0.7], SUN: [0.2, 0.6], GLOSS: 0.0},
    ),
    (
        "shadows of the chairs before the sun",
        {VIEW: [0.4, 0.9, 0.6, 0.9, 0.7], SUN: [0.7, 0.0], GLOSS: 0.3},
    ),
    (
        "lit by coloured pendants more than by the sky",
        {VIEW: [0.3, 0.6, 0.5, 0.9, 0.3], SUN: [1.0, 0.9], PENDANTS: [1.0, 0.35, 0.1]},
    ),
    (
        "a marble table under the pendants",
        {
            VIEW: [0.95, 0.9, 0.2, 0.8, 0.6],
            "dining_table_top_meshes.material": 0.9,
            PENDANTS: [0.9, 0.8, 0.7],
        },
    ),
    (
        "the coffee table in the sun, with all its things",
        {
            VIEW: [0.1, 0.7, 0.1, 0.2, 0.5],
            SUN: [0.4, 0.3],
            "coffee_table_top_meshes.material": 0.1,
            "teapot.visibility": 1,
            "books.visibility": 1,
        },
    ),
    (
        "dark walls and a bright floor lamp",
        {
            VIEW: [0.5, 0.5, 0.9, 0.2, 0.1],
            "wall_paint.albedo": [0.02, 0.05, 0.1],
            LAMP: 1.0,
            SUN: [0.9, 1.0],
        },
    ),
    (
        "sideboard and pictures in grazing light",
        {VIEW: [0.6, 0.4, 0.2, 0.95, 0.1], SUN: [1.0, 0.1], "vase.shape": 0.5},
    ),
    (
        "red walls that colour everything",
        {VIEW: [0.7, 0.8, 1.0, 0.4, 0.3], "wall_paint.albedo": [0.9, 0.2, 0.1], SUN: [0.3, 0.1]},
    ),
    (
        "against the light, chairs before the window",
        {VIEW: [1.0, 0.4, 0.0, 0.0, 0.9], SUN: [0.6, 0.2], GLOSS: 0.15},
    ),
]
