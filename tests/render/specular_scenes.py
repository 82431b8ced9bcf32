"""Scenes with mirrors and glass, and where NumPy says that their camera rays end."""

import numpy as np
import torch

from tests.render.optics import (
    ORIGIN,
    SIZE,
    dot,
    fresnel,
    on_plane,
    on_unit_sphere,
    rays,
    rectangle,
    reflected,
    refracted,
)

BLACK = '<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>'
RESOLUTION = 24
INDEX = 1.5
GLASS = f'<bsdf type="dielectric" id="glass"><float name="int_ior" value="{INDEX}"/>\
<float name="ext_ior" value="1"/></bsdf>'
SILVER = '<bsdf type="conductor" id="silver"><rgb name="eta" value="0.2, 0.9, 1.1"/>\
<rgb name="k" value="3.9, 2.4, 2.2"/>\
<rgb name="specular_reflectance" value="0.9, 0.8, 0.7"/></bsdf>'
ROUGH = '<bsdf type="twosided" id="steel"><bsdf type="roughconductor">\
<string name="material" value="none"/>{alpha}</bsdf></bsdf>'
STEEL = "{object: steel, property: roughness, minimum: 0.01, maximum: 0.09}"
PICTURE = '<emitter type="area"><texture type="bitmap" name="radiance">\
<string name="filename" value="picture.png"/></texture></emitter>'
PLAIN = '<emitter type="area"><rgb name="radiance" value="0.5"/></emitter>'
COLOURS = np.random.default_rng(0).integers(60, 255, (4, 4, 3)).astype(np.uint8)
BRIGHTEST = 1.0
"""Of the radiance anywhere in these scenes."""

BACK = rectangle(
    "wall", '<scale value="4"/><translate z="-3"/>', BLACK.replace(">", ' id="paint">', 1) + PICTURE
)
SIDE = rectangle(
    "side", '<scale value="4"/><rotate y="1" angle="-90"/><translate x="3"/>', BLACK + PICTURE
)
SKY = '<emitter type="constant"><rgb name="radiance" value="0.3"/></emitter>'
TILTED = '<scale value="1.2"/><rotate y="1" angle="45"/>'
MIRROR_NORMAL = np.array([np.sqrt(0.5), 0, np.sqrt(0.5)])
PLATE = f'<shape type="cube"><transform name="to_world"><scale x="2" y="2" z="0.25"/>\
<rotate y="1" angle="30"/></transform>{GLASS}</shape>'
PANE = f'<shape type="cube"><transform name="to_world"><scale x="0.25" y="3" z="3"/>\
<translate x="2"/></transform>{GLASS}</shape>'
BALL = f'<shape type="sphere"><float name="radius" value="1"/>{GLASS}</shape>'
PAINT = "{object: paint, property: albedo, minimum: [0, 0, 0], maximum: [1, 1, 1]}"

SCENES = {
    "mirror": BACK + SIDE + SKY + rectangle("mirror", TILTED, SILVER),
    "glowing mirror": BACK + SIDE + SKY + rectangle("mirror", TILTED, SILVER + PICTURE),
    "slab": BACK + PLATE,
    "sphere": BACK + BALL,
    "lamp in a slab": BACK
    + PLATE
    + rectangle("lamp", '<rotate y="1" angle="30"/>', BLACK + PICTURE),
    "mirror and slab": BACK + SIDE + SKY + rectangle("mirror", TILTED, SILVER) + PANE,
}


def mirror():
    """End of the chain, direction there, throughput; where the mirror is met and the wall after."""
    d = rays(RESOLUTION)
    start = on_plane(ORIGIN, d, np.zeros(3), MIRROR_NORMAL)
    away = reflected(d, MIRROR_NORMAL)
    end = on_plane(start, away, np.array([3.0, 0, 0]), [1, 0, 0])
    met = (abs(start[..., :2] * [np.sqrt(2), 1]) < 1.2).all(-1) & (abs(end[..., 1:]) < 4).all(-1)
    return end, away, silver(d, MIRROR_NORMAL), met


def silver(direction, normal):
    index = np.array([0.2, 0.9, 1.1]) + 1j * np.array([3.9, 2.4, 2.2])
    return fresnel(-dot(direction, normal), index) * [0.9, 0.8, 0.7]


def slab():
    """Parallel shift, and the transmittance of two equal interfaces."""
    d = rays(RESOLUTION)
    normal = np.array([np.sin(np.radians(30)), 0, np.cos(np.radians(30))])
    enter = on_plane(ORIGIN, d, 0.25 * normal, normal)
    inside = refracted(d, normal, INDEX)
    leave = on_plane(enter, inside, -0.25 * normal, normal)
    end = on_plane(leave, d, np.array([0, 0, -3.0]), [0, 0, 1])
    passed = (1 - fresnel(-dot(d, normal), INDEX)) ** 2
    met = (abs(enter) < 1.5).all(-1)
    return end, d, np.broadcast_to(passed, d.shape), met


def sphere():
    """In and out again; where the entry reflects more than it lets in, reflection."""
    d = rays(RESOLUTION, fov=32)
    enter = on_unit_sphere(ORIGIN, d, leaving=False)
    share = fresnel(-dot(d, enter), INDEX)
    inside = refracted(d, enter, INDEX)
    leave = on_unit_sphere(enter, inside, leaving=True)
    through = refracted(inside, -leave, 1 / INDEX)
    reflects = share > 0.5
    start = np.where(reflects, enter, leave)
    away = np.where(reflects, reflected(d, enter), through)
    end = on_plane(start, away, np.array([0, 0, -3.0]), [0, 0, 1])
    throughput = np.where(reflects, share, (1 - share) ** 2)
    met = np.isfinite(enter).all(-1) & (abs(end[..., :2]) < 4).all(-1) & (away[..., 2] < 0)
    return end, away, np.broadcast_to(throughput, d.shape), met


def mirror_and_slab():
    """The mirror's chain, shifted by the pane on its way to the wall."""
    d = rays(RESOLUTION)
    start = on_plane(ORIGIN, d, np.zeros(3), MIRROR_NORMAL)
    away = reflected(d, MIRROR_NORMAL)
    normal = np.array([-1.0, 0, 0])
    enter = on_plane(start, away, np.array([1.75, 0, 0]), normal)
    leave = on_plane(enter, refracted(away, normal, INDEX), np.array([2.25, 0, 0]), normal)
    end = on_plane(leave, away, np.array([3.0, 0, 0]), normal)
    passed = (1 - fresnel(-dot(away, normal), INDEX)) ** 2
    _, _, _, met = mirror()
    return end, away, silver(d, MIRROR_NORMAL) * passed, met


def buffers(renderer, v=None, resolution=RESOLUTION):
    """Name -> [n, n, channels], positions in the scene's units: what the renderer says."""
    v = torch.zeros(renderer.dimensions) if v is None else torch.tensor(v)
    image = renderer.image_buffers(v, resolution=resolution).numpy()
    named = {name: image[..., renderer.layout.slice(name)] for name in renderer.layout.names}
    return named | {"position": (2 * named["position"] - 1) * SIZE}
