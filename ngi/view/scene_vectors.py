"""Which configurations are shown: one that is given, a hard frame, or a path through several."""

import json
from pathlib import Path

import numpy as np
import torch
from scipy.interpolate import PchipInterpolator
from torch import Tensor

from ngi.render import Renderer
from ngi.view.path_traced_run import PathTracedRun
from ngi.view.trained_run import TrainedRun

PATHS = ("camera", "hard_frames", "static")


def given_vector(v: list[float], *, dimensions: int, name: str) -> Tensor:
    """[D] float32; ValueError, naming it, for what is not D numbers from 0 to 1."""
    try:
        vector = torch.tensor(v, dtype=torch.float32)
    except (TypeError, ValueError):
        vector = torch.empty(0)
    inside = (vector >= 0) & (vector <= 1)  # NaN is outside too
    if vector.shape != (dimensions,) or not inside.all():
        raise ValueError(f"{name}: {v}; expected {dimensions} numbers from 0 to 1")
    return vector


def hard_frame(renderer: Renderer, index: int) -> Tensor:
    """[D]; ValueError where the scene has fewer."""
    frames = renderer.hard_frames()
    if not 0 <= index < len(frames):
        raise ValueError(f"hard_frame: {index}; there are 0 to {len(frames) - 1}")
    return frames[index]


def key_frames(path: str, run: TrainedRun | PathTracedRun, *, still: int) -> Tensor:
    """[K, D]: the configurations that a path goes through.

    path: 'camera' for the scene's own path, which of closed formulas is that through the hard
        frames; 'hard_frames'; 'static' for the hard frame `still` alone; or a JSON file with a
        list of v, or with {"v": v} as the viewer saves it.
    Raises ValueError for anything else.
    """
    if path == "static":
        return hard_frame(run.renderer, still)[None]
    if path == "camera" and run.description is not None:
        return torch.tensor(run.description.camera_path)
    if path in PATHS:
        return run.renderer.hard_frames()
    return _read(Path(path), dimensions=run.renderer.dimensions)


def along(keys: Tensor, count: int) -> Tensor:
    """[count, D]: v at equal steps of time through key frames [K, D], which are equally far apart.

    Every component is a monotone cubic between its key frames (PCHIP): smooth, and never outside
    the key frames' range. A path that ends where it began is closed, and smooth there too; its
    last step leads back to the first v, which is not given twice. A single key frame stands still.
    """
    if len(keys) == 1:
        return keys.repeat(count, 1)
    values, closed = keys.double().numpy(), torch.equal(keys[0], keys[-1])
    times = np.arange(float(len(keys)))
    if closed:  # a key frame more on both sides decides the slopes at the seam
        values = np.concatenate([values[-2:-1], values, values[1:2]])
        times = np.arange(-1.0, len(keys) + 1)
    shown = np.linspace(0, len(keys) - 1, count, endpoint=not closed)
    return torch.from_numpy(PchipInterpolator(times, values)(shown)).float().clamp(0, 1)


def _read(file: Path, *, dimensions: int) -> Tensor:
    if not file.is_file():
        raise ValueError(f"path: '{file}' is neither {', '.join(PATHS)} nor a file")
    try:
        vectors = json.loads(file.read_text())
    except ValueError as error:
        raise ValueError(f"path: {file} is not a JSON file ({error})") from error
    if isinstance(vectors, dict) and "v" in vectors:
        vectors = [vectors["v"]]
    if not isinstance(vectors, list) or not vectors:
        raise ValueError(f"path: {file} holds no list of v")
    return torch.stack(
        [
            given_vector(v, dimensions=dimensions, name=f"path: {file}[{index}]")
            for index, v in enumerate(vectors)
        ]
    )
