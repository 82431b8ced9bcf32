"""A trained network with the renderer of its scene, from a run's folder alone."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import torch
from numpy.typing import ArrayLike
from torch import Tensor, nn

from ngi.evaluate.metrics import radiance_of
from ngi.files.durable import DamagedError
from ngi.files.run_folder import LAST, PREVIOUS
from ngi.learn import Samples, network_of, read_checkpoint
from ngi.machine.captured import Captured, Function
from ngi.machine.precision import shown_in
from ngi.view.run_settings import OpenedRun, made_by, make_samples, opened, plain, settings_of

log = logging.getLogger(__name__)

RECORDS = "ngi.learn.graph_trainer.GraphTrainer"
"""The trainer that has a run's steps recorded."""

NETWORK, AVERAGED = "network.", "averaged.module."
"""What the names of the network's weights, and of their average, begin with in a checkpoint."""


@dataclass(frozen=True, kw_only=True)
class TrainedRun(OpenedRun):
    """The network as the newest checkpoint of a run has it, and the renderer of its scene.

    Its weights are the averaged ones where the run has such, as in its evaluations.

    step: training steps it has had
    precision: as Lightning names that of training, which is that of `predict` too where the
        machine has units for it
    samples: what the network was trained on, which says what it is given
    image: `Samples.render` of it, as a tuple, recorded as CUDA graphs where the run's steps were
    """

    step: int
    precision: str
    samples: Samples
    network: nn.Module
    image: Function

    @classmethod
    def open(
        cls,
        folder: Path | str,
        *,
        scene_path: Path | str | None = None,
        supersampled_edges: bool = False,
    ) -> TrainedRun:
        """Loads a finished, interrupted or running run; nothing of it is changed or executed.

        scene_path: of a scene in the authors' format; others are known by name.
        supersampled_edges: of its pictures, which otherwise are as the run's evaluations.

        Raises FileNotFoundError where this is no run's folder or it has no checkpoint yet, and
        ValueError for a damaged one, for a scene that is unknown or has changed since, and for a
        run without a network.
        """
        folder = Path(folder)
        with settings_of(folder) as settings:
            checkpoint = newest_checkpoint(folder, settings)
            run = opened(folder, settings, scene_path)
            samples = make_samples(settings, run["renderer"], supersampled_edges=supersampled_edges)
            make = partial(made_by(settings, "model"), **plain(settings["model"]))
            network = network_of(samples, make)
            network.load_state_dict(trained_weights(checkpoint["state_dict"]))
            device = "cuda" if torch.cuda.is_available() else "cpu"
            network = network.to(device).eval()
            return cls(
                **run,
                step=checkpoint["global_step"],
                precision=settings["trainer"]["precision"],
                samples=samples,
                network=network,
                image=_image(network, samples, recorded=settings["trainer"]["_target_"] == RECORDS),
            )

    def predict(self, buffers: Tensor, scene_vector: Tensor, *, preview: bool = False) -> Tensor:
        """Buffers [H, W, C] and v [D] in [0, 1] to log1p of linear RGB [H, W, 3], on the CPU.

        preview: see `Samples.test_inputs`
        """
        device = next(self.network.parameters()).device
        dtype = shown_in(self.precision, device.type)
        inputs = self.samples.test_inputs(scene_vector, buffers, preview=preview)
        on_device = (tensor.to(device) for tensor in (buffers, *inputs))
        precision = torch.autocast(device.type, torch.bfloat16, enabled=dtype == torch.bfloat16)
        with torch.no_grad(), precision:
            output: Tensor = self.image(*on_device)[0]
        return output.float().cpu()

    def radiance(self, scene_vector: ArrayLike | Tensor, *, resolution: int) -> Tensor:
        """[H, W, 3] on the CPU: the network's image of a v [D]; linear RGB, possibly negative.

        scene_vector: numbers in [0, 1], as a list, an array or a tensor of any precision
        """
        scene_vector = torch.as_tensor(scene_vector, dtype=torch.float32)
        buffers = self.renderer.image_buffers(scene_vector, resolution=resolution)
        return radiance_of(self.predict(buffers, scene_vector))


def _image(network: nn.Module, samples: Samples, *, recorded: bool) -> Function:
    def rendered(*inputs: Tensor) -> tuple[Tensor]:
        return (samples.render(network, *inputs),)

    return Captured(rendered, module=network, name="images") if recorded else rendered


def trained_weights(state: dict[str, Tensor]) -> dict[str, Tensor]:
    """The network's, of all that a checkpoint has."""
    prefix = AVERAGED if any(name.startswith(AVERAGED) for name in state) else NETWORK
    return {
        name.removeprefix(prefix): value for name, value in state.items() if name.startswith(prefix)
    }


def newest_checkpoint(folder: Path, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Of the run's two checkpoints the newer one that is whole; raises as `TrainedRun.open`.

    Warns where that is not the newest.
    """
    if "path_tracing" in settings:
        raise ValueError(
            f"{folder} has no network: it is a path tracing run; `ngi video` shows its frames"
        )
    problems = []
    for path in (folder / name for name in (LAST, PREVIOUS)):
        if not path.exists():
            continue
        try:
            checkpoint = read_checkpoint(path)
        except DamagedError as error:
            problems.append(str(error))
            continue
        for problem in problems:
            log.warning("%s; using the previous checkpoint", problem)
        return checkpoint
    if problems:
        raise ValueError("; ".join(problems))
    raise FileNotFoundError(f"{folder}: no checkpoint yet; a run saves one a minute by default")
