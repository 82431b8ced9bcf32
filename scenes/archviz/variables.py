"""scene.yaml of the living room: its 71 variables, from the ranges in rooms.py."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from clearance import CAMERA
from frames import CAMERA_PATH, HARD_FRAMES, Frame
from rooms import MOVERS, Mover


@dataclass(frozen=True)
class Entry:
    """One entry of scene.yaml's variables: its line, its name in frames.py, its components."""

    text: str
    name: str
    components: int


def numbers(*values: float) -> str:
    return "[" + ", ".join(f"{v:g}" for v in values) + "]"


def line(objects: str | list[str], prop: str, **keys: object) -> Entry:
    """One variable; numbers in tuples become lists."""
    named = objects if isinstance(objects, str) else f"[{', '.join(objects)}]"
    rest = "".join(
        f", {key}: {numbers(*value) if isinstance(value, tuple) else value}"
        for key, value in keys.items()
    )
    low, high = keys.get("minimum"), keys.get("maximum")
    varied = [a != b for a, b in zip(low, high, strict=True)] if isinstance(low, tuple) else [True]
    first = objects if isinstance(objects, str) else objects[0]
    text = f"  - {{object: {named}, property: {prop}{rest}}}"
    return Entry(text, f"{first}.{prop}", sum(varied))


def choice(name: str, prop: str, *choices: str) -> Entry:
    return line(name, prop, choices=f"[{', '.join(choices)}]")


def moves(name: str, mover: Mover, *others: str) -> list[Entry]:
    """Translation and rotation of a mover and of what stands on it; then which of it shows."""
    objects = [*mover.pieces, *others]
    alone = objects[0] if len(objects) == 1 else objects
    low, high = ((v[0], 0, v[1]) for v in (mover.low, mover.high))
    lines = [line(alone, "translation", minimum=low, maximum=high)]
    if mover.turns != (0, 0):
        pivot, (least, most) = (mover.x, 0, mover.z), mover.turns
        lines.append(
            line(alone, "rotation", axis=(0, 1, 0), pivot=pivot, minimum=least, maximum=most)
        )
    if mover.choices:
        lines.append(choice(name, "shape", *mover.pieces))
    return lines


def variables() -> list[Entry]:
    (x0, y0, z0), (x1, y1, z1) = CAMERA
    low, high = (x0, y0, z0, -2.0, 0.85, -2.0), (x1, y1, z1, 1.8, 0.85, -0.6)
    lines = [line("camera", "look_at", minimum=low, maximum=high)]
    for name, mover in MOVERS.items():
        if name != "plant":
            lines += moves(name, mover, *(["floor_lamp_globe"] if name == "floor_lamp" else []))
    pendants, dim, bright = ["pendant_left", "pendant_right"], (2, 2, 2), (22, 22, 22)
    return [
        *lines,
        line("rug", "translation", minimum=(-0.3, 0, -0.2), maximum=(0.3, 0, 0.2)),
        line("rug", "rotation", axis=(0, 1, 0), minimum=-12, maximum=12),
        choice("rug_wool", "texture", "rug_0.jpg", "rug_1.jpg", "rug_2.jpg"),
        choice("picture_left_print", "texture", *(f"shapes_{i}.jpg" for i in (0, 2, 3))),
        choice("picture_middle_print", "texture", *(f"shapes_{i}.jpg" for i in (1, 3, 0))),
        choice("picture_right_print", "texture", *(f"hills_{i}.jpg" for i in range(3))),
        choice("coffee_table_top_meshes", "material", "marble", "wood", "ebony"),
        choice("dining_table_top_meshes", "material", "oak", "ebony", "marble"),
        *(line(name, "visibility") for name in ("books", "teapot", "fruit_bowl", "plant")),
        line("sofa_fabric", "albedo", minimum=(0.05, 0.05, 0.05), maximum=(0.85, 0.85, 0.85)),
        line("wall_paint", "albedo", minimum=(0.25, 0.25, 0.25), maximum=(0.9, 0.9, 0.9)),
        line("curtain_fabric", "albedo", minimum=(0.1, 0.1, 0.1), maximum=(0.85, 0.85, 0.85)),
        line("floor_boards", "roughness", minimum=0.06, maximum=0.4),
        line("floor_lamp_globe", "intensity", minimum=0, maximum=2),
        line(pendants, "radiance", minimum=dim, maximum=bright),
        line("sun", "direction", minimum=(240, 18), maximum=(300, 50)),
    ]


HEAD = """\
# A living room with a dining area: everything in it moves, turns or changes (71 dimensions).
# Written by make.py.
name: archviz
scene: scene.xml
samples_per_pixel: 400
max_depth: 8
bounds: {minimum: [-4.4, 0, -3.2], maximum: [4.2, 2.75, 3.2]}
variables:
"""


def vector(frame: Frame, seed: int) -> np.ndarray:
    """The v of a frame: the named components as given, all others drawn at random.

    Raises ValueError for a name that is no variable, or for a wrong number of components.
    """
    random, parts, known = np.random.Generator(np.random.PCG64(seed)), [], dict(frame)
    for entry in variables():
        drawn = np.round(random.uniform(0.1, 0.9, entry.components), 2)
        if entry.name.endswith("albedo"):
            drawn = np.round(drawn.mean() + 0.4 * (drawn - drawn.mean()), 2)
        parts.append(np.array(known.pop(entry.name, drawn), dtype=float).reshape(entry.components))
    if known:
        raise ValueError(f"frames.py: {sorted(known)} are no variables of the scene")
    return np.concatenate(parts)


def scene_yaml() -> str:
    lines = [entry.text for entry in variables()]
    lines.append("camera_path:")
    lines += [f"  - {numbers(*vector(frame, 100 + i // 3))}" for i, frame in enumerate(CAMERA_PATH)]
    lines.append("hard_frames:")
    for i, (comment, frame) in enumerate(HARD_FRAMES):
        lines.append(f"  - {numbers(*vector(frame, i))}  # {comment}")
    return HEAD + "\n".join(lines) + "\n"
