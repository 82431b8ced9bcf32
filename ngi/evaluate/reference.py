"""A reference image: two independent halves, their noise, and the file they are kept in."""

from __future__ import annotations

import hashlib
import math
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from ngi.files.durable import PARTIAL_SUFFIX, DamagedError, full_disk_named


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
    """Writes one .npz file atomically: a crash or a full disk leaves the old file or none.

    Several processes may write the same one. Raises OSError with what to do where that fails.
    """
    partial = path.with_suffix(f".{os.getpid()}{PARTIAL_SUFFIX}")
    try:
        with full_disk_named(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            _write(partial, reference)
            partial.replace(path)
    finally:
        with suppress(OSError):  # of a folder that could not be made
            partial.unlink()


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
