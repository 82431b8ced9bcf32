"""Where in the image a point of the scene is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ngi.machine.backend import mi
from ngi.scene import transforms
from ngi.scene.scene_files import SceneFile
from ngi.scene.variable_scene import VariableScene


def require_told_camera(scene: VariableScene) -> None:
    """Raises ValueError where another variable than look_at and camera_path moves the camera."""
    if scene.scene.sensors()[0].id() in scene.moving:
        raise ValueError(
            f"{scene.description.name}: variables other than look_at and camera_path move the "
            "camera, so its place does not follow from these alone"
        )


def require_perspective(scene: mi.Scene, *, document: SceneFile) -> None:
    """Raises ValueError where the camera is no perspective one with a whole square film, and where
    it stands in a medium.

    document: what the scene was loaded from
    """
    path, sensor = document.path, scene.sensors()[0]
    if sensor.class_name() != "PerspectiveCamera":
        raise ValueError(
            f"{path}: the camera is a {sensor.class_name()}; make it <sensor "
            "type='perspective'>: this program supports only pinhole cameras"
        )
    film = sensor.film()
    width, height = film.size()
    if [*film.crop_size(), *film.crop_offset()] != [width, height, 0, 0]:
        raise ValueError(
            f"{path}: the film is cropped; remove crop_width, crop_height, crop_offset_x and "
            "crop_offset_y"
        )
    if width != height:
        raise ValueError(
            f"{path}: the film is {width} x {height}; make width and height equal, since the "
            "virtual image is a square"
        )
    _require_no_medium(document)


def _require_no_medium(document: SceneFile) -> None:
    """Of the camera, as the file has it: Mitsuba does not tell it."""
    media = {medium.get("id") for medium in document.root.iter("medium")}
    for child in document.root.iterfind("sensor[1]/*"):
        if child.tag == "medium" or (child.tag == "ref" and child.get("id") in media):
            raise ValueError(
                f"{document.places.get(child, document.path)}: the camera is in a medium; "
                f"remove this <{child.tag}>: this program starts paths in empty space"
            )


class Projection:
    """The perspective camera of a scene, as matrices that take points to the film.

    Raises ValueError as `require_told_camera` does.
    """

    def __init__(self, scene: VariableScene) -> None:
        self._description = scene.description
        require_told_camera(scene)
        parameters = mi.traverse(scene.scene.sensors()[0])
        self._authored = np.array(parameters["to_world"].matrix, dtype=np.float64).reshape(4, 4)
        self._as_authored = transforms.mirroring(transforms.mirrors(self._authored))
        self._fov = float(np.ravel(parameters["x_fov"])[0])
        self._shift = [float(np.ravel(parameters[f"principal_point_offset_{a}"])[0]) for a in "xy"]

    def matrices(self, scene_vectors: NDArray[np.float32]) -> NDArray[np.float64]:
        """[n, 4, 4] for v [n, D]; see `ngi.render.Renderer.projections`."""
        low, high = map(np.array, self._description.bounds)
        to_world = np.eye(4)
        to_world[:3] = np.column_stack([np.diag(high - low), low])
        found = []
        for v in scene_vectors:
            placed = self._description.camera_to_world(v)
            camera = self._authored if placed is None else placed @ self._as_authored
            fov = self._description.field_of_view(v) or self._fov
            found.append(self._to_film(fov) @ np.linalg.inv(camera) @ to_world)
        return np.array(found).reshape(-1, 4, 4)

    def _to_film(self, fov: float) -> NDArray[np.float64]:
        """[4, 4]: from the camera's own coordinates.

        A film coordinate is 1/2 - offset - x / (2 z tan(fov / 2)); local x is to the left, y up.
        """
        half = np.tan(np.radians(fov) / 2)
        return np.array(
            [
                [-0.5 / half, 0, 0.5 - self._shift[0], 0],
                [0, -0.5 / half, 0.5 - self._shift[1], 0],
                [0, 0, 1, 0],
                [0, 0, 1, 0],
            ]
        )
