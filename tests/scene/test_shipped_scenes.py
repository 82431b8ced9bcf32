"""Clearances in shipped scenes, what the mirror shows, and when the shutters let light in."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
import yaml
from skimage.measure import points_in_poly

from tests.scene.ply import read_ply

SCENES = Path(__file__).parents[2] / "scenes"
CLEARANCE = 0.005


def scene_files(name):
    root = ElementTree.parse(SCENES / name / "scene.xml").getroot()
    return root, yaml.safe_load((SCENES / name / "scene.yaml").read_text())


def shape_translation(root, identifier):
    translate = root.find(f".//shape[@id='{identifier}']/transform/translate")
    return np.array([float(translate.get(axis, 0)) for axis in "xyz"])


def travel(specification, identifier):
    """Least and greatest offset of a moving object, [2, 3]."""
    variable = next(
        v
        for v in specification["variables"]
        if v["object"] == identifier and v["property"] == "translation"
    )
    return np.array([variable["minimum"], variable["maximum"]])


def test_sphere_and_light_stay_clear_of_the_room_and_of_each_other() -> None:
    root, specification = scene_files("sphere-caustic")
    trim, _ = read_ply(SCENES / "sphere-caustic" / "trim.ply")
    radius = float(root.find(".//shape[@id='sphere']/float[@name='radius']").get("value"))
    centre = shape_translation(root, "sphere") + travel(specification, "sphere")
    light = shape_translation(root, "light") + travel(specification, "light")
    scale = root.find(".//shape[@id='light']/transform/scale")
    half = np.array([float(scale.get("x")), 0, float(scale.get("y"))])
    skirting = 0.02
    minimum, maximum = trim.min(axis=0), trim.max(axis=0)
    assert (centre[0] - radius > minimum + np.array([skirting, CLEARANCE, skirting])).all()
    assert (centre[1] + radius < maximum - skirting).all()
    assert centre[1, 1] + radius < light[0, 1] - 0.2
    assert ((light[0] - half) > minimum).all()
    assert ((light[1] + half) < maximum).all()


def share_of_figure_in_mirror(scene_vector):
    # Seen from the camera's mirror image, what the mirror shows lies inside the pane's outline;
    # nothing else stands in the way.
    root, specification = scene_files("mirror")
    parts = [read_ply(SCENES / "mirror" / f"{name}.ply")[0][:, :3] for name in ("hare", "plinth")]
    low, high = shape_translation(root, "figure") + travel(specification, "figure")
    position = low + np.array([scene_vector[0], 0, scene_vector[1]]) * (high - low)
    points = np.concatenate(parts)[::7] + position
    outline, _ = read_ply(SCENES / "mirror" / "mirror.ply")
    lookat = root.find(".//sensor/transform/lookat")
    camera = np.array([float(c) for c in lookat.get("origin").split(",")])
    plane = outline[0, 2]
    behind = camera * [1, 1, -1] + [0, 0, 2 * plane]
    t = (plane - behind[2]) / (points[:, 2] - behind[2])
    return points_in_poly((behind + t[:, None] * (points - behind))[:, :2], outline[:, :2]).mean()


def test_mirror_shows_the_figure_from_a_narrow_range_only() -> None:
    grid = [(x, z) for x in np.linspace(0, 1, 41) for z in (0.0, 0.5, 1.0)]
    visible = np.array([share_of_figure_in_mirror(v) for v in grid])
    assert 0.15 < (visible > 0).mean() < 0.35
    assert 0.10 < (visible > 0.5).mean() < 0.30
    _, specification = scene_files("mirror")
    assert all(share_of_figure_in_mirror(v) > 0.1 for v in specification["hard_frames"])


def test_figure_stays_behind_the_camera_and_clear_of_the_room() -> None:
    root, specification = scene_files("mirror")
    hare, _ = read_ply(SCENES / "mirror" / "hare.ply")
    plinth, _ = read_ply(SCENES / "mirror" / "plinth.ply")
    points = np.concatenate([hare[:, :3], plinth[:, :3]])
    low, high = shape_translation(root, "figure") + travel(specification, "figure")
    frames, _ = read_ply(SCENES / "mirror" / "picture_frames.ply")
    lookat = root.find(".//sensor/transform/lookat")
    camera_z = float(lookat.get("origin").split(",")[2])
    assert (low + points.min(axis=0))[2] > camera_z + 0.2
    assert (high + points.max(axis=0))[2] < frames[:, 2].min() - CLEARANCE
    assert (low + points.min(axis=0))[0] > -3.4 + 0.025
    assert (high + points.max(axis=0))[0] < 3.4 - 0.025
    assert points[:, 1].min() == 0


def light_let_in(scene_vectors, paths=500):
    """Share of the rays from the lamp to the inner hole that the outer one lets through, [n].

    scene_vectors: [n, 9]
    """
    root, specification = scene_files("shutters")
    random = np.random.default_rng(0)
    lamp = shape_translation(root, "lamp")
    radius = float(root.find(".//shape[@id='lamp']/float").get("value"))
    ball = random.normal(size=(paths, 3))
    start = lamp + radius * ball / np.linalg.norm(ball, axis=1, keepdims=True)

    def hole(name, components):
        """Centres [n, 3] and radius; the shutters are drawn about their holes."""
        low, high = shape_translation(root, name) + travel(specification, name)
        v = np.insert(scene_vectors[:, components], 0, 0.0, axis=1)
        corners, _ = read_ply(SCENES / "shutters" / f"{name}.ply")
        return low + v * (high - low), np.linalg.norm(corners[:, 1:3], axis=1).min()

    outer, outer_radius = hole("outer_shutter", [0, 1])
    inner, inner_radius = hole("inner_shutter", [2, 3])
    angle, distance = 2 * np.pi * random.random(paths), np.sqrt(random.random(paths))
    disk = distance[:, None] * np.stack([np.zeros(paths), np.cos(angle), np.sin(angle)], axis=1)
    end = inner[:, None] + inner_radius * disk
    share = (outer[:, None, :1] - start[..., :1]) / (end[..., :1] - start[..., :1])
    crossing = start + share * (end - start)
    return (np.linalg.norm(crossing - outer[:, None], axis=-1) < outer_radius).mean(axis=1)


def test_shutters_let_light_in_at_few_of_their_positions() -> None:
    let_in = light_let_in(np.random.default_rng(1).random((10_000, 9)))
    # Wherever a ray crosses the outer shutter's plane: the share of its positions that are in line.
    _, specification = scene_files("shutters")
    low, high = travel(specification, "outer_shutter")
    expected = np.pi * 0.05**2 / np.prod((high - low)[1:])
    assert let_in.mean() == pytest.approx(expected, abs=3 * let_in.std() / 100)
    assert 0.03 < (let_in > 0.01).mean() < 0.07
    hard = light_let_in(np.array(specification["hard_frames"]))
    assert (hard[:7] > 0.9).all()
    assert ((hard[7:] > 0.1) & (hard[7:] < 0.9)).all()
