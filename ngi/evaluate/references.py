"""Reference images, rendered once to a stated noise level and cached by content."""

import hashlib
import json
import logging
import math
import os
import secrets
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from ngi.evaluate.protocol import EvaluationProtocol
from ngi.files.durable import PARTIAL_SUFFIX, DamagedError, full_disk_named
from ngi.render.protocol import Renderer


@dataclass(frozen=True)
class Reference:
    """A reference image in two independent halves.

    key: content hash, also the cache file's name
    half_a, half_b: [H, W, 3] float32, linear RGB radiance, each from half of the samples
    samples_per_pixel: of both halves together
    noise: mean relative standard error of `radiance`, see `relative_noise`
    backend: what rendered it, for the record
    """

    key: str
    half_a: Tensor
    half_b: Tensor
    samples_per_pixel: int
    noise: float
    backend: str

    @property
    def radiance(self) -> Tensor:
        """[H, W, 3] linear RGB, the mean of the halves.

        Its error has the distribution of (half_a - half_b) / 2 = half_a - radiance, so
        metric(half_a, radiance) is what a perfect prediction would score: the metric's floor. That
        holds for MAPE and MAE. For DSSIM and LPIPS it holds in order of magnitude only and is a
        lower bound, since they also see that half_a, unlike the truth, is noisy itself: where noise
        of variance s in the mean lies on a smooth picture, twice the DSSIM is s / (s + C2) for the
        truth and s / (3 s + C2) for half_a, which has twice that variance.
        """
        return 0.5 * (self.half_a + self.half_b)

    @property
    def content_hash(self) -> str:
        """Hash of what predictions are compared with: the radiance of both halves."""
        digest = hashlib.sha256()
        for tensor in (self.half_a, self.half_b):
            digest.update(tensor.contiguous().numpy().tobytes())
        return digest.hexdigest()


def relative_noise(half_a: Tensor, half_b: Tensor, epsilon: float) -> float:
    """Mean over pixels of standard error / (radiance + epsilon) of the mean of two halves.

    half_a, half_b: [H, W, 3] linear radiance, independent and of the same variance. A pixel's
    standard error is estimated as sqrt(π / 2) |a - b| / 2, unbiased for normal noise.
    """
    radiance = 0.5 * (half_a + half_b)
    deviation = 0.5 * (half_a - half_b).abs()
    return math.sqrt(math.pi / 2) * (deviation / (radiance + epsilon)).double().mean().item()


def write_reference(path: Path, reference: Reference) -> None:
    """Writes one .npz file atomically, where there is none: a crash or a full disk leaves none.

    Of several processes that write the same one the first does (on a disk without hard links the
    last): pictures of two backends differ in the last bits, and the first may have been compared
    with already. Raises OSError with what to do where writing fails.
    """
    partial = path.with_suffix(f".{secrets.token_hex(8)}{PARTIAL_SUFFIX}")
    try:
        with full_disk_named(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            _write(partial, reference)
            _publish(partial, path)
    finally:
        with suppress(OSError):  # of a folder that could not be made
            partial.unlink()


def _publish(partial: Path, path: Path) -> None:
    try:
        os.link(partial, path)
    except FileExistsError:
        pass
    except OSError:  # a disk without hard links
        partial.replace(path)


def _write(path: Path, reference: Reference) -> None:
    with path.open("wb") as stream:
        np.savez_compressed(
            stream,
            key=np.array(reference.key),
            half_a=reference.half_a.numpy(),
            half_b=reference.half_b.numpy(),
            samples_per_pixel=np.array(reference.samples_per_pixel),
            noise=np.array(reference.noise),
            backend=np.array(reference.backend),
        )
        stream.flush()
        os.fsync(stream.fileno())


def read_reference(path: Path, *, resolution: int) -> Reference:
    """Reads what `write_reference` wrote; raises DamagedError where it is not that any more."""
    try:
        # numpy would leave a damaged file open.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            reference = Reference(
                key=str(file["key"]),
                half_a=torch.from_numpy(file["half_a"]),
                half_b=torch.from_numpy(file["half_b"]),
                samples_per_pixel=int(file["samples_per_pixel"]),
                noise=float(file["noise"]),
                backend=str(file["backend"]),
            )
    except Exception as error:  # zipfile and numpy raise nearly anything on a damaged file
        raise DamagedError(f"{path} is damaged ({type(error).__name__}: {error})") from error
    expected = (resolution, resolution, 3)
    if reference.key != path.stem or reference.half_a.shape != expected:
        raise DamagedError(f"{path} is damaged (its content is not what its name says)")
    return reference


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
                path.unlink(missing_ok=True)
        write_reference(path, _render(renderer, protocol, scene_vector, key=key, on_pass=on_pass))
        return read_reference(path, resolution=protocol.resolution)


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
