"""Cameras and objects where they should not be, and every corner of the shipped scenes."""

from __future__ import annotations

import itertools
from functools import partial

import torch
from torch import Tensor

from ngi.patches import BufferLayout
from ngi.render.workers import mitsuba_renderer
from ngi.scene import read_scene, scenes
from ngi.studies.stability.backends import BACKENDS
from ngi.studies.stability.case import Case, Conditions, Outcome
from ngi.studies.stability.rooms import FLOOR, LAMP, MOVING, Room, ball

OVER = {"backend": BACKENDS}
CORNERS = 256
SAMPLES = 4
ROUNDING = 1e-3


def _inside(conditions: Conditions, *, origin: tuple[float, float, float]) -> Outcome:
    shapes = FLOOR + ball() + LAMP.format(radiance=10, half=0.3)
    room = Room(shapes=shapes, variables=(MOVING,), origin=origin)
    picture = room.radiance(conditions.backend, 0.5, 0.5, 0.5)
    return Outcome(finite=picture.finite, done=picture.done)


def _interpenetrating(conditions: Conditions, *, x: float) -> Outcome:
    """A second ball over the first one; where they coincide nothing may change but the noise."""
    lamp = LAMP.format(radiance=10, half=0.3)
    both = FLOOR + ball() + ball(name="other", x=x) + lamp
    picture = Room(shapes=both, variables=(MOVING,)).radiance(conditions.backend, 0.5, 0.5, 0.5)
    if x > 0:
        return Outcome(finite=picture.finite, done=picture.done)
    alone = Room(shapes=FLOOR + ball() + lamp, variables=(MOVING,))
    mean = alone.radiance(conditions.backend, 0.5, 0.5, 0.5).radiance.mean()
    return Outcome(
        finite=picture.finite,
        error=float((picture.radiance.mean() - mean).abs() / mean),
        limit=0.05,
        done=picture.done,
    )


def _corners(conditions: Conditions) -> Outcome:
    """Corners and faces of the hypercube, with the patch in the corners of the image."""
    assert conditions.scene is not None
    description = read_scene(**scenes()[conditions.scene])
    renderer = mitsuba_renderer(
        workers=0, cluster=None, scene=description, samples_per_pixel=SAMPLES, patch_size=16
    )
    states = corner_states(renderer.dimensions)
    finite, repaired, masked, worst = True, 0, 0, 0.0
    for seed, chunk in enumerate(states.split(16)):
        patches = renderer.render_patches(chunk, resolution=32, seed=seed)
        finite &= bool(patches.buffers.isfinite().all() and patches.log_radiance.isfinite().all())
        repaired, masked = repaired + patches.repaired, masked + patches.masked
        worst = max(worst, _out_of_range(patches.buffers, renderer.layout))
    renderer.close()
    return Outcome(
        finite=finite,
        error=worst,
        limit=ROUNDING,
        done=f"{len(states)} states: {repaired} patches rendered again, {masked} masked",
    )


def corner_states(dimensions: int) -> Tensor:
    """[n, D + 2]: all corners or 256 of them, then both faces of every variable."""
    generator = torch.Generator().manual_seed(0)
    if 2**dimensions <= CORNERS:
        corners = torch.tensor(list(itertools.product((0.0, 1.0), repeat=dimensions)))
    else:
        corners = torch.randint(2, (CORNERS, dimensions), generator=generator).float()
    faces = torch.rand(2 * dimensions, dimensions, generator=generator)
    for variable in range(dimensions):
        faces[2 * variable, variable], faces[2 * variable + 1, variable] = 0.0, 1.0
    v = torch.cat([corners, faces])
    positions = torch.randint(2, (len(v), 2), generator=generator).float()
    return torch.cat([v, positions], dim=1)


def _out_of_range(buffers: Tensor, layout: BufferLayout) -> float:
    """How far buffers are outside what `BufferLayout` says of them."""
    ranges = {"position": (0, 1), "normal": (0, 1), "outgoing": (-1, 1), "albedo": (0, 1)}
    worst = 0.0
    for name, (low, high) in ranges.items():
        if name in layout.names:
            values = buffers[..., layout.slice(name)]
            worst = max(worst, float(low - values.min()), float(values.max() - high))
    return worst


CASES = (
    Case("corners and faces of the hypercube", _corners, {"scene": tuple(scenes())}),
    Case("camera inside an object", partial(_inside, origin=(0.1, 0.75, 0.1)), OVER),
    Case("camera on a surface", partial(_inside, origin=(0.3, 0.0, 1.5)), OVER),
    Case("two objects in one place", partial(_interpenetrating, x=0.0), OVER),
    Case("two objects that overlap", partial(_interpenetrating, x=0.4), OVER),
)
