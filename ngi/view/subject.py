"""What a page is about: a scene that a network shows, and the camera in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ngi.evaluate import EvaluationProtocol
from ngi.render import Renderer
from ngi.scene import SceneDescription
from ngi.scene.kinds import LookAt
from ngi.view.inputs import Control, controls, unnamed_controls
from ngi.view.targets import nearest_target

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """The scene's camera, moved within the box that v has for it.

    variable: of the scene; part: its components of v
    """

    variable: LookAt
    part: slice

    @property
    def up(self) -> tuple[float, ...]:
        return self.variable.up

    def view(self, v: ArrayLike) -> tuple[Vector, Vector]:
        """Origin and target at a v of shape [D], world space."""
        value = self.variable.value(np.asarray(v, dtype=np.float64)[self.part])
        return value[:3], value[3:]

    def components(self, origin: ArrayLike, target: ArrayLike) -> Vector:
        """Those components of v that come closest to a view; origin and target in world space.

        The target counts as a direction only, since a mouse that turns a camera does not say how
        far away it looks: see `nearest_target`.
        """
        low, high = np.array(self.variable.minimum), np.array(self.variable.maximum)
        least, most = np.minimum(low, high), np.maximum(low, high)  # the authors' may fall
        start = np.clip(np.asarray(origin, dtype=np.float64), least[:3], most[:3])
        direction = np.asarray(target, dtype=np.float64) - np.asarray(origin, dtype=np.float64)
        end = start + nearest_target(direction, least[3:] - start, most[3:] - start)
        varied = low != high
        value = np.concatenate([start, end])[varied]
        components: Vector = np.clip((value - low[varied]) / (high - low)[varied], 0, 1)
        return components


def camera_of(description: SceneDescription) -> Camera | None:
    """None where no variable of the scene lets the camera walk."""
    for variable, part in description.parts():
        if isinstance(variable, LookAt) and not variable.linked and part.stop > part.start:
            return Camera(variable, part)
    return None


@dataclass(frozen=True)
class Subject:
    """A scene and its network.

    name: for titles
    folder: of the run
    controls: of every component of v
    presets: configurations by name, each of length D
    buffers: names of those that the network is fed
    camera: None where v does not let it walk
    protocol: that metrics are measured by
    scene: its folder, where the run's own files do not say it
    supersampled_edges: whether the network is asked so, though the run itself may not
    """

    name: str
    folder: Path
    controls: tuple[Control, ...]
    presets: Mapping[str, Sequence[float]]
    buffers: tuple[str, ...]
    camera: Camera | None
    protocol: EvaluationProtocol
    scene: str | None
    supersampled_edges: bool

    @property
    def start(self) -> Sequence[float]:
        """Where a page begins: the first of the presets, [D]."""
        return next(iter(self.presets.values()))


def subject(
    *,
    name: str,
    folder: Path,
    description: SceneDescription | None,
    renderer: Renderer,
    protocol: EvaluationProtocol,
    scene: str | None,
    supersampled_edges: bool,
) -> Subject:
    """name: for titles, before the end of the folder's, which tells runs apart
    description: of the scene; None for closed formulas, whose variables have no names
    """
    frames = renderer.hard_frames().tolist()
    return Subject(
        name=f"{name} ({Path(*folder.resolve().parts[-2:])})",
        folder=folder,
        controls=unnamed_controls(renderer.dimensions)
        if description is None
        else controls(description),
        presets={f"hard frame {index}": frame for index, frame in enumerate(frames)},
        buffers=renderer.layout.names,
        camera=None if description is None else camera_of(description),
        protocol=protocol,
        scene=scene,
        supersampled_edges=supersampled_edges,
    )
