"""What stands and hangs in the bedroom besides the bed. Every piece faces +z, floor at y = 0."""

from __future__ import annotations

import numpy as np
from modelling.furniture import Parts, merged, placed, rod, smooth_bar
from modelling.meshes import Mesh, box, lathe, rectangle, rounded_box, sphere, surface, sweep, tube
from modelling.ornaments import leaf

DOOR_WIDTH, WARDROBE_HEIGHT, WARDROBE_DEPTH = 0.6, 2.25, 0.58


def wardrobe() -> Parts:
    """Four doors about x = 0, the middle two with mirrors; the back lies at z = 0."""
    half, front = 2 * DOOR_WIDTH, WARDROBE_DEPTH
    carcass = [box((-half, 0.08, 0), (half, WARDROBE_HEIGHT, front - 0.03))]
    carcass.append(box((-half + 0.03, 0, 0.05), (half - 0.03, 0.08, front - 0.08)))
    carcass.append(box((-half - 0.02, WARDROBE_HEIGHT, 0), (half + 0.02, 2.3, front + 0.02)))
    parts: Parts = {"walnut": carcass, "lacquer": [], "silvering": [], "brass": []}
    for door in range(4):
        left = -half + door * DOOR_WIDTH + 0.003
        low, high = (left, 0.1, front - 0.028), (left + DOOR_WIDTH - 0.006, 2.24, front)
        if door in (1, 2):
            parts["walnut"].append(box(low, high))
            size = (DOOR_WIDTH - 0.086, 0, 0), (0, 2.06, 0)
            parts["silvering"].append(rectangle((left + 0.04, 0.14, front + 0.002), *size))
        else:
            parts["lacquer"].append(rounded_box(low, high, 0.004, 1))
        handle = left + (DOOR_WIDTH - 0.026 if door % 2 == 0 else 0.02)
        parts["brass"].append(
            rod((handle, 0.95, front + 0.03), (handle, 1.25, front + 0.03), 0.007)
        )
        for y in (0.98, 1.22):
            parts["brass"].append(rod((handle, y, front), (handle, y, front + 0.03), 0.005))
    return parts


def bedside_table() -> Parts:
    """0.46 wide, 0.5 high, 0.4 deep, about the origin: two drawers on tapered legs."""
    wood = [box((-0.23, 0.2, -0.2), (0.23, 0.5, 0.18))]
    legs = [
        rod((x, 0.2, z), (1.12 * x, 0, 1.12 * z), 0.018, 0.011)
        for x in (-0.19, 0.19)
        for z in (-0.15, 0.15)
    ]
    fronts = [
        rounded_box((-0.222, y, 0.181), (0.222, y + 0.138, 0.2), 0.003, 1) for y in (0.21, 0.353)
    ]
    knobs = [sphere(0.014, 12).moved(0, y, 0.216) for y in (0.279, 0.422)]
    return {"walnut": wood + legs + fronts, "brass": knobs}


def globe_lamp() -> Parts:
    """A brass foot and stem for an opal globe of radius 0.1 whose centre is 0.33 above the foot."""
    foot = lathe(
        [(0, 0), (0.08, 0), (0.083, 0.004), (0.083, 0.012), (0.07, 0.02), (0.018, 0.03),
         (0.012, 0.05), (0.011, 0.13), (0.02, 0.15), (0.011, 0.17), (0.011, 0.22), (0.05, 0.235),
         (0.054, 0.245), (0.05, 0.244), (0, 0.232)],
        32,
    )  # fmt: skip
    return {"brass": [foot]}


def framed_picture(width: float, height: float) -> tuple[Mesh, Mesh]:
    """A print about the origin and its frame, a few centimetres before the plane z = 0."""
    x, y = width / 2, height / 2
    outline = np.array([(-x, -y), (x, -y), (x, y), (-x, y)])
    profile = [(0.0, 0.014), (0.0, 0.028), (0.022, 0.028), (0.025, 0.02), (0.025, 0.001)]
    return rectangle((-x, -y, 0.015), (width, 0, 0), (0, height, 0)), sweep(outline, profile)


def curtain(width: float, height: float, phase: float) -> Mesh:
    """A gathered curtain in the plane z = 0 from x = 0 to width, from the floor to height."""
    u, v = np.meshgrid(np.linspace(0, 1, 97), np.linspace(0, 1, 9))
    waves = 2 * np.pi * (6.5 * u + phase + 0.12 * np.sin(2.2 * u + 3 * v))
    depth = 0.04 * (1.15 - 0.45 * v) * np.sin(waves) + 0.01 * np.sin(2.3 * waves)
    x = width * u + 0.012 * np.sin(2 * waves) - 0.04 * (1 - v) * (0.5 - u)
    return surface(np.stack([x, 0.02 + (height - 0.02) * v, depth], axis=-1))


def radiator(width: float) -> list[Mesh]:
    """Columns about x = 0, from y = 0.1 to 0.55, from z = 0.02 to 0.1."""
    count = round(width / 0.06)
    left = -0.03 * count
    columns = [
        rounded_box(
            (left + 0.06 * i + 0.006, 0.1, 0.02), (left + 0.06 * i + 0.054, 0.55, 0.1), 0.02, 2
        )
        for i in range(count)
    ]
    pipes = [rod((left + 0.01, y, 0.06), (-left - 0.01, y, 0.06), 0.014) for y in (0.15, 0.5)]
    feed = smooth_bar(
        [(-left - 0.02, 0.15, 0.06), (-left + 0.06, 0.13, 0.06), (-left + 0.07, 0, 0.06)], 0.01
    )
    return [*columns, *pipes, feed]


def rubber_plant(height: float) -> Parts:
    """Two stems with large leaves around them, in a pot of radius 0.19."""
    pot = lathe([(0, 0), (0.14, 0), (0.15, 0.01), (0.19, 0.33), (0.19, 0.35), (0.172, 0.35),
                 (0.165, 0.3), (0, 0.3)], 40)  # fmt: skip
    leaves, stems = [], []
    for stem, (lean_x, lean_z, top) in enumerate(
        [(0.1, 0.06, height), (-0.12, -0.04, 0.8 * height)]
    ):
        t = np.linspace(0, 1, 9)[:, None]
        path = np.array([0.03 * (1 - 2 * stem), 0.3, 0]) + t * np.array([lean_x, top - 0.3, lean_z])
        stems.append(tube(path, np.linspace(0.013, 0.006, 9), 8))
        count = 13 - 3 * stem
        for i in range(count):
            s = 0.25 + 0.75 * i / (count - 1)
            base = path[0] + s * (path[-1] - path[0])
            size = 0.3 - 0.1 * s
            blade = leaf(size, 0.5 * size, 62 * s - 8, 0.7, 137.5 * i + 80 * stem)
            leaves.append(blade.moved(*base))
    return {"clay": [pot], "leaf": leaves, "walnut": stems}


def books(sizes: list[tuple[float, float, float]]) -> Mesh:
    """One book of a pile: width, height and depth of each below, the last one is returned."""
    below = sum(size[1] for size in sizes[:-1])
    width, height, depth = sizes[-1]
    return box((-width / 2, below + 0.001, -depth / 2), (width / 2, below + height, depth / 2))


def bedside_things() -> Parts:
    """A pile of books and a cup, to stand on a table."""
    pile = [(0.2, 0.03, 0.14), (0.18, 0.022, 0.13), (0.16, 0.026, 0.12)]
    piled = [books(pile[: i + 1]).rotated("y", (8, -6, 14)[i]) for i in range(3)]
    cup = lathe([(0, 0), (0.03, 0), (0.036, 0.01), (0.038, 0.085), (0.035, 0.086), (0.033, 0.012),
                 (0, 0.01)], 28)  # fmt: skip
    things: Parts = {"blush": [piled[0]], "clay": [piled[1]], "lacquer": [piled[2]]}
    return merged(things, placed({"linen": [cup]}, -0.02, 0.079, 0.01))


def pouf() -> Mesh:
    """A round knitted seat, 0.36 high, ribbed like a melon."""
    angle = 2 * np.pi * np.arange(97) / 96
    latitude = np.linspace(-np.pi / 2, np.pi / 2, 17)
    a, b = np.meshgrid(angle, latitude)
    ribs = 1 - 0.035 * np.abs(np.sin(8 * a)) ** 0.4 * np.cos(b)
    radius = 0.27 * np.cos(b) ** 0.55 * ribs
    y = 0.18 + 0.18 * np.sign(np.sin(b)) * np.abs(np.sin(b)) ** 0.8
    points = np.stack([radius * np.cos(a), y, -radius * np.sin(a)], axis=-1)
    points[[0, -1]] = [[[0, 0, 0]], [[0, 0.355, 0]]]
    points[:, -1] = points[:, 0]
    return surface(points)
