"""Reference images, rendered once to a stated noise level and cached by content."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable
from pathlib import Path

import torch
from torch import Tensor

from ngi.evaluate.protocol import EvaluationProtocol
from ngi.evaluate.reference import (
    Reference,
    read_reference,
    relative_noise,
    write_reference,
)
from ngi.files.durable import DamagedError
from ngi.render.protocol import Renderer

log = logging.getLogger(__name__)

FORMAT_VERSION = 2
"""Of the cache files and how they are rendered; part of their names, so that an old file is never
misread."""

PassDone = Callable[[int, float], None]
"""Called after every pass with the samples per pixel so far and the noise measured then."""


class ReferenceCache:
    """Gives the reference of a frame from its folder, rendering it where it is not there yet.

    One file per frame, written atomically: an interrupted set goes on where it stopped. A file's
    name is the hash of the scene, v and the protocol's reference settings, not of the backend,
    which is only recorded. The seeds derive from that hash.
    """

    def __init__(self, folder: Path | str) -> None:
        self._folder = Path(folder)

    def get(
        self,
        renderer: Renderer,
        protocol: EvaluationProtocol,
        scene_vector: Tensor,
        *,
        on_pass: PassDone | None = None,
    ) -> Reference:
        """The reference image of one v of shape [D], in [0, 1]^D.

        A damaged file is rendered again. Raises RuntimeError where a pixel never became finite,
        OSError where the folder cannot be written.
        """
        key = _content_key(renderer, protocol, scene_vector)
        path = self._folder / f"{key}.npz"
        if path.exists():
            try:
                return read_reference(path, resolution=protocol.resolution)
            except DamagedError as error:
                log.warning("%s; this reference is rendered again", error)
        reference = _render(renderer, protocol, scene_vector, key=key, on_pass=on_pass)
        write_reference(path, reference)
        return reference


def _content_key(renderer: Renderer, protocol: EvaluationProtocol, scene_vector: Tensor) -> str:
    vector = scene_vector.detach().cpu().numpy().astype("<f4")
    content = {
        "format": FORMAT_VERSION,
        "scene": renderer.scene_hash,
        "scene_vector": vector.tobytes().hex(),
        **protocol.reference_settings,
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


def _seed(key: str, half: int, step: int) -> int:
    digest = hashlib.sha256(f"{key}/{half}/{step}".encode()).digest()
    return int.from_bytes(digest[:4], "little")


def _render(
    renderer: Renderer,
    protocol: EvaluationProtocol,
    scene_vector: Tensor,
    *,
    key: str,
    on_pass: PassDone | None,
) -> Reference:
    """Adds passes to both halves until the noise or the sample count is reached."""
    shape = (protocol.resolution, protocol.resolution, 3)
    total = torch.zeros(2, *shape, dtype=torch.float64)
    # NaN and Inf pixels of a pass are left out of the mean, pixel by pixel.
    passes = torch.zeros(2, *shape[:2], 1, dtype=torch.float64)
    for step in range(protocol.maximum_samples // (2 * protocol.samples_per_pass)):
        for half in range(2):
            radiance = renderer.render_image(
                scene_vector,
                resolution=protocol.resolution,
                samples_per_pixel=protocol.samples_per_pass,
                seed=_seed(key, half, step),
            )
            radiance = radiance.detach().cpu().double()
            finite = radiance.isfinite().all(dim=-1, keepdim=True)
            total[half] += torch.where(finite, radiance, 0.0)
            passes[half] += finite
        half_a, half_b = (total / passes).float()
        noise = relative_noise(half_a, half_b, protocol.epsilon)
        samples = 2 * protocol.samples_per_pass * (step + 1)
        if on_pass is not None:
            on_pass(samples, noise)
        if noise <= protocol.target_noise:
            break
    missing = int((passes == 0).sum())
    if missing:
        raise RuntimeError(
            f"reference {key}: {missing} pixels were NaN or Inf in every pass of "
            f"{protocol.samples_per_pass} samples; v = {scene_vector.tolist()}"
        )
    return Reference(key, half_a, half_b, samples, noise, renderer.description)
