"""Small scenes for the tests, their assets, edits of their XML, and the comparison of pictures."""

import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import torch
import yaml
from PIL import Image
from scipy import stats

from ngi.machine.backend import mi
from ngi.render.exr import write_exr

SCENES = Path(__file__).parent / "scenes"
RENDERINGS = 12
"""Independent renderings of one picture, of 16 samples per pixel each."""


def write_ply(path, points, triangles, normals=None) -> None:
    rows = np.asarray(points) if normals is None else np.hstack([points, normals])
    names = ("x", "y", "z", "nx", "ny", "nz")[: rows.shape[1]]
    lines = ["ply", "format ascii 1.0", f"element vertex {len(rows)}"]
    lines += [f"property float {name}" for name in names]
    lines += [f"element face {len(triangles)}", "property list uchar int vertex_indices"]
    lines += ["end_header", *(" ".join(map(repr, row)) for row in rows.tolist())]
    lines += [f"3 {a} {b} {c}" for a, b, c in triangles]
    path.write_text("\n".join(lines) + "\n")


def curtain(wave):
    """9 x 2 vertices with waves of this height, facing +z: vertices, triangles and normals."""
    s, width = np.linspace(-0.8, 0.8, 9), 1 - wave / 2
    z, slope = wave * np.sin(4 * s), 4 * wave * np.cos(4 * s) / width
    points = [np.stack([width * s, np.full(9, y), z], 1) for y in (-0.5, 0.5)]
    normals = np.stack([-slope, np.zeros(9), np.ones(9)], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    triangles = [t for i in range(8) for t in ((i, i + 1, i + 10), (i, i + 10, i + 9))]
    return np.concatenate(points), triangles, np.concatenate([normals, normals])


def write_assets(folder) -> None:
    corners = np.array([[-1, -1, -1], [1, -1, -1], [1, -1, 1], [-1, -1, 1], [-1, 1, 0]]) * 0.3
    faces = [(0, 1, 2), (0, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)]
    write_ply(folder / "wedge.ply", corners, faces)
    points = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [(a, b, c) for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    outside = [f if np.linalg.det(points[list(f)]) > 0 else f[::-1] for f in faces]
    write_ply(folder / "globe.ply", points * [1, 0.6, 0.4], outside)
    for i, wave in enumerate((0.0, 0.6, 0.2)):
        points, triangles, normals = curtain(wave)
        write_ply(folder / f"curtain_{i}.ply", points, triangles, normals)
        write_ply(folder / f"sheet_{i}.ply", points, triangles)
    random = np.random.default_rng(0)
    for name in ("plain", "dots", "stripes"):
        pixels = random.integers(40, 250, (4, 6, 3), np.uint8)
        Image.fromarray(pixels).save(folder / f"{name}.png")
    sky = random.uniform(0.1, 0.5, (4, 8, 3)).astype(np.float32)
    sky[1, 2] = 4
    write_exr(folder / "sky.exr", torch.from_numpy(sky))


def write_scene(folder, assets, name, variables, *, dimensions, edit=None):
    """scene.xml of a scene, edited, and a scene.yaml with these variables, beside the assets."""
    shutil.copytree(assets, folder)
    root = ElementTree.parse(SCENES / name / "scene.xml").getroot()
    if edit is not None:
        edit(root)
    ElementTree.ElementTree(root).write(folder / "scene.xml")
    content = {
        "name": name,
        "scene": "scene.xml",
        "samples_per_pixel": 8,
        "max_depth": int(root.find("integrator/integer").get("value")),
        "bounds": {"minimum": [-2, 0, -2], "maximum": [2, 3, 2]},
        "variables": variables,
        "camera_path": [[0.5] * dimensions],
        "hard_frames": [[0.5] * dimensions],
    }
    (folder / "scene.yaml").write_text(yaml.safe_dump(content))
    return folder


def find(root, object_id):
    return root.find(f".//*[@id='{object_id}']")


def set_value(root, object_id, name, value) -> None:
    """Sets the value of the colour, number or string of a name that an object holds."""
    find(root, object_id).find(f".//*[@name='{name}']").set("value", value)


def moved(object_id, *operations):
    """The edit that ends an object's to_world with operations such as ("scale", {"value": 2})."""

    def edit(root) -> None:
        owner = find(root, object_id)
        transform = owner.find("transform")
        if transform is None:
            transform = ElementTree.SubElement(owner, "transform", name="to_world")
        for name, attributes in operations:
            ElementTree.SubElement(transform, name, {k: repr(a) for k, a in attributes.items()})

    return edit


def translate(x, y, z):
    return "translate", {"x": x, "y": y, "z": z}


def rotate(axis, angle):
    return "rotate", {**dict(zip("xyz", axis, strict=True)), "angle": angle}


def scale(factor):
    return "scale", {"value": factor}


def about(pivot, operation):
    return translate(*(-c for c in pivot)), operation, translate(*pivot)


def pictures(scene, first_seed):
    """[RENDERINGS, 24, 24, 3]"""
    seeds = range(first_seed, first_seed + RENDERINGS)
    return np.stack([np.array(mi.render(scene, spp=16, seed=s), np.float64) for s in seeds])


def disagreement(a, b):
    """Probability that two sets of renderings differ as much as they do if their means are equal.

    Welch's test of every pixel and channel and of the means of 4 x 4 pixels, by the scatter of
    the renderings; the least probability after Sidak's correction for their number.
    """
    count, height, width, channels = a.shape
    tests = [(a, b)]
    blocks = (count, height // 4, 4, width // 4, 4, channels)
    tests.append(tuple(side.reshape(blocks).mean((2, 4)) for side in (a, b)))
    probabilities = np.concatenate([_welch(*sides).ravel() for sides in tests])
    return -np.expm1(len(probabilities) * np.log1p(-min(probabilities.min(), 1 - 1e-15)))


def _welch(a, b):
    parts = [side.var(0, ddof=1) / len(side) for side in (a, b)]
    rounding = 1e-4 * np.abs(a.mean(0)) + 1e-9  # what is the same without noise may be rounded
    error = np.sqrt(sum(parts)) + rounding
    freedom = (sum(parts) + 1e-30) ** 2 / (
        sum(part**2 for part in parts) / (len(a) - 1) + 1e-60 / (len(a) - 1)
    )
    return 2 * stats.t.sf(np.abs(a.mean(0) - b.mean(0)) / error, freedom)
