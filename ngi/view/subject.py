"""What a page is about: a scene that a network shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ngi.evaluate import EvaluationProtocol
from ngi.render import Renderer
from ngi.scene import SceneDescription
from ngi.view.camera import Camera, camera_of
from ngi.view.controls import Control, controls, unnamed_controls


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
    """

    name: str
    folder: Path
    controls: tuple[Control, ...]
    presets: Mapping[str, Sequence[float]]
    buffers: tuple[str, ...]
    camera: Camera | None
    protocol: EvaluationProtocol


def subject(
    *,
    name: str,
    folder: Path,
    description: SceneDescription | None,
    renderer: Renderer,
    protocol: EvaluationProtocol,
) -> Subject:
    """description: of the scene; None for closed formulas, whose variables have no names."""
    frames = renderer.hard_frames().tolist()
    return Subject(
        name=name,
        folder=folder,
        controls=unnamed_controls(renderer.dimensions)
        if description is None
        else controls(description),
        presets={f"hard frame {index}": frame for index, frame in enumerate(frames)},
        buffers=renderer.layout.names,
        camera=None if description is None else camera_of(description),
        protocol=protocol,
    )
