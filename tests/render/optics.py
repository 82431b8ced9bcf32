"""Small scenes of mirrors and glass for the tests, and geometrical optics in closed form."""

import numpy as np
import yaml
from PIL import Image

ORIGIN = np.array([0.0, 0.0, 4.0])
SIZE = 5.0
"""Half of the side of the box that normalises positions."""


def write_scene(folder, *, shapes, variables, max_depth=10, fov=20, image=None) -> None:
    """A 'camera' at ORIGIN that looks along -z; image [h, w, 3]: of the texture 'picture.png'."""
    (folder / "scene.xml").write_text(f"""<scene version="3.0.0">
        <integrator type="path"><integer name="max_depth" value="{max_depth}"/></integrator>
        <sensor id="camera" type="perspective"><float name="fov" value="{fov}"/>
            <transform name="to_world">
                <lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="8"/>
                <integer name="height" value="8"/><rfilter type="box"/></film></sensor>
        {shapes}</scene>""")
    ranges = [yaml.safe_load(entry) for entry in variables]
    count = sum(np.not_equal(r.get("minimum", 0), r.get("maximum", 1)).sum() for r in ranges)
    (folder / "scene.yaml").write_text(
        f"{{name: optics, scene: scene.xml, samples_per_pixel: 4, max_depth: {max_depth},\n"
        f"bounds: {{minimum: {[-SIZE] * 3}, maximum: {[SIZE] * 3}}},\n"
        f"variables: [{', '.join(variables)}],\n"
        f"camera_path: [{[0] * count}], hard_frames: [{[0.5] * count}]}}"
    )
    if image is not None:
        Image.fromarray(image).save(folder / "picture.png")


def rectangle(name, to_world, inside):
    """inside: XML of its BSDF and emitter."""
    return (
        f'<shape type="rectangle" id="{name}"><transform name="to_world">{to_world}</transform>'
        f"{inside}</shape>"
    )


def rays(resolution, fov=20):
    """[n, n, 3]: unit directions through the pixels' centres."""
    u = ((np.arange(resolution) + 0.5) / resolution - 0.5) * 2 * np.tan(np.radians(fov / 2))
    x, y = np.meshgrid(u, -u)
    return unit(np.stack([x, y, -np.ones_like(x)], -1))


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def dot(a, b):
    return (a * b).sum(-1, keepdims=True)


def on_plane(origin, direction, point, normal):
    """Where rays meet a plane."""
    normal = np.asarray(normal, dtype=float)
    return origin + dot(point - origin, normal) / dot(direction, normal) * direction


def on_unit_sphere(origin, direction, *, leaving):
    """Where rays meet the unit sphere about 0, first or last; NaN where they miss it."""
    b = dot(origin, direction)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b**2 - dot(origin, origin) + 1)
    return origin + (-b + (root if leaving else -root)) * direction


def reflected(direction, normal):
    return direction - 2 * dot(direction, normal) * normal


def refracted(direction, normal, ratio):
    """Snell's law; ratio: index outside of the normal's side over the one on it. NaN: total
    reflection.
    """
    cosine = -dot(direction, normal)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(1 - (1 - cosine**2) / ratio**2)
    return direction / ratio + (cosine / ratio - root) * normal


def fresnel(cosine, index):
    """Unpolarised reflectance at a cosine of incidence from outside; index may be complex.

    NaN for a cosine of NaN.
    """
    root = np.sqrt(index**2 - 1 + cosine**2 + 0j)
    with np.errstate(invalid="ignore"):
        across = (cosine - root) / (cosine + root)
        along = (index**2 * cosine - root) / (index**2 * cosine + root)
    return (abs(across) ** 2 + abs(along) ** 2) / 2
