"""A trained network with the renderer of its scene, from a run's folder alone."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from hydra.utils import get_object
from omegaconf import DictConfig, OmegaConf
from torch import Tensor, nn

from ngi.durable import DamagedError
from ngi.evaluate import EvaluationProtocol
from ngi.learn import PatchSamples, Samples, read_checkpoint
from ngi.render import Renderer
from ngi.render.workers import mitsuba_renderer
from ngi.resources import root
from ngi.scene import SceneDescription, read_scene, scenes
from ngi.scene.release import read_release

CHECKPOINTS = ("last.ckpt", "previous.ckpt")
NETWORK = "network."
"""What the names of the network's weights begin with in a checkpoint."""


@dataclass(frozen=True)
class TrainedRun:
    """The network as the newest checkpoint of a run has it, and the renderer of its scene.

    step: training steps it has had
    precision: as Lightning names that of training, which is that of `predict` too
    protocol: that its evaluations measured by
    description: of its scene; None for closed formulas
    samples: what the network was trained on, which says what it is given
    """

    folder: Path
    scene_name: str
    step: int
    precision: str
    protocol: EvaluationProtocol
    description: SceneDescription | None
    renderer: Renderer
    samples: Samples
    network: nn.Module

    @classmethod
    def open(cls, folder: Path, *, scene_path: Path | None = None) -> TrainedRun:
        """Loads a finished, interrupted or running run; nothing of it is changed or executed.

        scene_path: of a scene in the authors' format; others are known by name.

        Raises FileNotFoundError where this is no run's folder or it has no checkpoint yet, and
        ValueError for a damaged one and for a scene that is unknown or has changed since.
        """
        settings = _settings(folder)
        checkpoint = _newest(folder)
        description = _description(settings, scene_path)
        renderer = _renderer(folder, settings, description)
        samples = _samples(settings, renderer)
        network = _made_by(settings, "model")(
            **_plain(settings["model"]),
            layout=samples.layout,
            scene_dimensions=samples.dimensions,
        )
        weights = {
            name.removeprefix(NETWORK): value
            for name, value in checkpoint["state_dict"].items()
            if name.startswith(NETWORK)
        }
        network.load_state_dict(weights)
        device = "cuda" if torch.cuda.is_available() else "cpu"
        return cls(
            folder=folder,
            scene_name=settings["scene"]["name"],
            step=checkpoint["global_step"],
            precision=settings["trainer"]["precision"],
            protocol=EvaluationProtocol(**_plain(settings["evaluation"]["evaluator"]["protocol"])),
            description=description,
            renderer=renderer,
            samples=samples,
            network=network.to(device).eval(),
        )

    def predict(self, buffers: Tensor, scene_vector: Tensor) -> Tensor:
        """Buffers [H, W, C] and v [D] in [0, 1] to log1p of linear RGB [H, W, 3], on the CPU."""
        device = next(self.network.parameters()).device
        reduced = self.precision == "bf16-mixed"
        inputs = self.samples.test_inputs(scene_vector, resolution=len(buffers))
        on_device = (tensor.to(device) for tensor in (buffers, *inputs))
        with torch.autocast(device.type, dtype=torch.bfloat16, enabled=reduced):
            output: Tensor = self.network.render(*on_device)  # type: ignore[operator]
        return output.float().cpu()

    def radiance(self, scene_vector: Tensor, *, resolution: int) -> Tensor:
        """[H, W, 3]: what the network says of a v of shape [D]; linear RGB, possibly negative."""
        buffers = self.renderer.image_buffers(scene_vector, resolution=resolution)
        return torch.expm1(self.predict(buffers, scene_vector))


def _settings(folder: Path) -> dict[str, Any]:
    path = folder / "settings.json"
    if not path.exists():
        raise FileNotFoundError(
            f"{path}: no such file; name the folder of one run, outputs/…/seed=0 for example"
        )
    try:
        settings: dict[str, Any] = json.loads(path.read_text())
    except ValueError as error:
        raise ValueError(f"{path} is damaged ({error})") from error
    return settings


def _newest(folder: Path) -> dict[str, Any]:
    """Of the run's two checkpoints the newer one that is whole."""
    problems = []
    for path in (folder / name for name in CHECKPOINTS):
        if not path.exists():
            continue
        try:
            return read_checkpoint(path)
        except DamagedError as error:
            problems.append(str(error))
    if problems:
        raise ValueError("; ".join(problems))
    raise FileNotFoundError(f"{folder}: no checkpoint yet; a run writes one every minute or so")


def _made_by(settings: dict[str, Any], group: str) -> Callable[..., Any]:
    """What makes a part of the run: the `_target_` of one of the group's options in conf/.

    A run's folder may be somebody else's, and a `_target_` can name any function there is.
    """
    target = settings[group]["_target_"]
    options = [OmegaConf.load(file) for file in (root() / "conf" / group).glob("*.yaml")]
    known = {option.get("_target_") for option in options if isinstance(option, DictConfig)}
    if not isinstance(target, str) or target not in known:
        raise ValueError(
            f"settings.json: {group}._target_ is '{target}', which no option of the group {group} "
            "names; only what comes with this program is opened"
        )
    return get_object(target)


def _samples(settings: dict[str, Any], renderer: Renderer) -> Samples:
    """Runs of before there was a group `data` were trained on patches."""
    if "data" not in settings:
        return PatchSamples(renderer=renderer)
    samples: Samples = _made_by(settings, "data")(**_plain(settings["data"]), renderer=renderer)
    return samples


def _plain(arguments: dict[str, Any]) -> dict[str, Any]:
    """Without Hydra's own keys."""
    return {name: value for name, value in arguments.items() if not name.startswith("_")}


def _description(settings: dict[str, Any], path: Path | None) -> SceneDescription | None:
    """What varies in the run's scene; None where it is made of closed formulas."""
    name = settings["scene"]["name"]
    if _made_by(settings, "renderer") is not mitsuba_renderer:
        return None
    if path is not None:
        return read_release(path)
    if name not in (known := scenes()):
        raise ValueError(
            f"scene '{name}' is not known here: name the folder above it in NGI_SCENES, or one of "
            "the authors' scenes by scene=FOLDER"
        )
    return read_scene(**known[name])


def _renderer(
    folder: Path, settings: dict[str, Any], description: SceneDescription | None
) -> Renderer:
    """Of the scene as the run was trained on it, in this process, on whatever it has."""
    options = _plain(settings["renderer"])
    if description is not None:
        options |= {"backend": "auto", "scene": description, "workers": 0, "cluster": None}
    renderer: Renderer = _made_by(settings, "renderer")(**options)
    if renderer.scene_hash != settings["scene"]["hash"]:
        raise ValueError(
            f"{folder} was trained on '{settings['scene']['name']}' as it was then; the scene has "
            "changed since, and a network knows only what it was trained on"
        )
    return renderer
