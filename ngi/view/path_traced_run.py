"""A run without a network: path tracing, as it was measured, opened from its folder."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from torch import Tensor

from ngi.denoise import Denoiser, OpenImageDenoise, OptixDenoise
from ngi.methods.path_tracing import PathTracing
from ngi.view.run_settings import OpenedRun, opened, settings_of
from ngi.view.trained_run import TrainedRun

DENOISERS = {f"ngi.denoise.{kind.__name__}": kind for kind in (OpenImageDenoise, OptixDenoise)}


@dataclass(frozen=True, kw_only=True)
class PathTracedRun(OpenedRun):
    """Frames of a run of `ngi.methods.path_tracing`, with the samples per pixel that it had.

    step: of training, 0
    """

    path_tracing: PathTracing
    step: int = 0

    @classmethod
    def open(cls, folder: Path, *, scene_path: Path | str | None = None) -> PathTracedRun:
        """Loads a finished run; nothing of it is changed or executed.

        scene_path: of a scene in the authors' format; others are known by name.

        Raises FileNotFoundError where it is not finished, ValueError for a scene or denoiser that
        is unknown, and RuntimeError where the denoiser does not work here.
        """
        with settings_of(folder) as settings:
            if not (result := folder / "result.json").exists():
                raise FileNotFoundError(f"{result}: no such file; the run is not finished yet")
            denoiser = _denoiser(settings["path_tracing"]["denoiser"])
            run = opened(folder, settings, scene_path)
            return cls(
                **run,
                path_tracing=PathTracing(
                    renderer=run["renderer"],
                    denoiser=denoiser,
                    samples_per_pixel=json.loads(result.read_text())["frame"]["samples_per_pixel"],
                    seed=settings["seed"],
                ),
            )

    def radiance(self, scene_vector: Tensor, *, resolution: int) -> Tensor:
        """[H, W, 3] linear radiance of the next frame; its noise is new in every frame."""
        return self.path_tracing.radiance(scene_vector, resolution=resolution)


def open_run(
    folder: Path, *, scene_path: Path | str | None = None, supersampled_edges: bool = False
) -> TrainedRun | PathTracedRun:
    """Whichever of the two the folder holds; raises what their `open` raises.

    supersampled_edges: see `TrainedRun.open`; path tracing shows edges as they are
    """
    with settings_of(folder) as settings:
        path_traced = "path_tracing" in settings
    if path_traced:
        return PathTracedRun.open(folder, scene_path=scene_path)
    return TrainedRun.open(folder, scene_path=scene_path, supersampled_edges=supersampled_edges)


def _denoiser(settings: dict[str, Any] | None) -> Denoiser | None:
    if settings is None:
        return None
    target = settings["_target_"]
    if target not in DENOISERS:
        raise ValueError(
            f"settings.json: path_tracing.denoiser._target_ is '{target}', which is not part of "
            "this program (no option of the group path_tracing names it)"
        )
    return DENOISERS[target]()
