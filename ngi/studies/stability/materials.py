"""Materials at the ends of their ranges, against closed forms: furnaces, in which nothing is lost
or gained that the material does not say.
"""

from __future__ import annotations

from functools import partial

from ngi.studies.stability.backends import BACKENDS
from ngi.studies.stability.case import Case, Conditions, Outcome
from ngi.studies.stability.rooms import FURNACE, SKY, Room, ball

OVER = {"backend": BACKENDS}
SAMPLES = 64

LEAST = 1e-3
"""Roughness that a variable may have."""

ALBEDO = {
    "object": "paint",
    "property": "albedo",
    "minimum": [0, 0, 0],
    "maximum": [1, 1, 1],
    "linked": True,
}
MOVED = {"property": "translation", "minimum": [0, 0, 0], "maximum": [0.1, 0, 0]}

CONDUCTOR = (
    '<bsdf type="roughconductor" id="material"><string name="material" value="none"/>'
    '<string name="distribution" value="ggx"/><float name="alpha" value="{alpha}"/></bsdf>'
)
GLASS = '<bsdf type="dielectric" id="{name}"><float name="int_ior" value="{ior}"/>{outside}</bsdf>'
ROUGH_GLASS = (
    '<bsdf type="roughdielectric" id="material"><string name="distribution" value="ggx"/>'
    '<float name="alpha" value="{alpha}"/><float name="int_ior" value="1.5"/></bsdf>'
)


def _white_room(conditions: Conditions, *, albedo: float, depth: int) -> Outcome:
    """Every wall emits 1 and reflects `albedo`: paths of n vertices bring albedo^(n - 1) each."""
    room = Room(shapes=FURNACE, variables=(ALBEDO,), depth=depth)
    picture = room.radiance(conditions.backend, albedo, samples=SAMPLES)
    expected = sum(albedo**bounce for bounce in range(depth))
    return Outcome(
        finite=picture.finite,
        error=abs(float(picture.radiance.mean()) / expected - 1),
        limit=0.02,  # of Russian roulette's noise, beyond the fifth bounce
        done=picture.done,
    )


def _furnace(conditions: Conditions, *, bsdf: str, exact: bool) -> Outcome:
    """A ball in a sky of radiance 1: it may absorb, but shows no more than 1; glass exactly 1."""
    room = Room(
        shapes=SKY.format(radiance=1) + ball(bsdf),
        variables=({"object": "ball", **MOVED},),
        depth=64,
    )
    picture = room.radiance(conditions.backend, 0.0, samples=SAMPLES)
    mean = float(picture.radiance[12:20, 12:20].mean())  # the ball fills these pixels
    return Outcome(
        finite=picture.finite,
        error=abs(mean - 1) if exact else max(0.0, mean - 1),
        limit=0.02,
        done=f"{picture.done}; shows {mean:.3f}",
    )


def _varying_roughness(conditions: Conditions, *, minimum: float) -> Outcome:
    """Roughness as a variable has a lower end, below which the sampling of normals breaks down."""
    variable = {"object": "material", "property": "roughness", "minimum": minimum, "maximum": 1}
    room = Room(
        shapes=SKY.format(radiance=1) + ball(CONDUCTOR.format(alpha=0.5)), variables=(variable,)
    )
    try:
        picture = room.radiance(conditions.backend, 0.0)
    except ValueError as error:
        said = str(error).partition("scene.yaml: ")[2]
        return Outcome(finite=True, done=f"refused: {said}", as_expected=minimum < LEAST)
    return Outcome(finite=picture.finite, done=picture.done, as_expected=minimum >= LEAST)


def _nested_glass(conditions: Conditions) -> Outcome:
    """A ball of glass in a ball of water in a sky of radiance 1 is not to be seen."""
    water = ball(GLASS.format(name="water", ior=1.33, outside=""))
    outside = '<float name="ext_ior" value="1.33"/>'
    core = ball(GLASS.format(name="glass", ior=1.5, outside=outside), name="core", radius=0.3)
    room = Room(
        shapes=SKY.format(radiance=1) + water + core,
        variables=({"object": "core", **MOVED},),
        depth=64,
    )
    picture = room.radiance(conditions.backend, 0.0, samples=SAMPLES)
    return Outcome(
        finite=picture.finite,
        error=abs(float(picture.radiance.mean()) - 1),
        limit=0.02,
        done=picture.done,
    )


CASES = (
    *(
        Case(
            f"white room, albedo {albedo:g}, depth {depth}",
            partial(_white_room, albedo=albedo, depth=depth),
            OVER,
        )
        for albedo, depth in ((0.0, 8), (0.5, 1), (0.5, 64), (1.0, 2), (1.0, 64))
    ),
    *(
        Case(
            f"furnace, {name} of roughness {roughness:g}",
            partial(_furnace, bsdf=bsdf.format(alpha=roughness), exact=False),
            OVER,
        )
        for name, bsdf in (("conductor", CONDUCTOR), ("glass", ROUGH_GLASS))
        for roughness in (0.0, 1e-4, LEAST, 1.0)
    ),
    *(
        Case(
            f"roughness varies from {minimum:g}",
            partial(_varying_roughness, minimum=minimum),
            OVER,
        )
        for minimum in (0.0, 1e-4, LEAST)
    ),
    *(
        Case(
            f"furnace, glass of refractive index {ior:g}",
            partial(
                _furnace,
                bsdf=GLASS.format(name="material", ior=ior, outside=""),
                exact=True,
            ),
            OVER,
        )
        for ior in (1.0, 1.5, 3.0)
    ),
    Case("glass in water", _nested_glass, OVER),
)
