"""OpenEXR files of linear radiance."""

from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from ngi.files.durable import DamagedError, write_atomically
from ngi.machine.backend import a_worker_thread, activate, mi

LARGEST_HALF = 65504.0
"""The largest finite number of 16 bits."""


def write_exr(path: Path, radiance: Tensor, *, half: bool = False) -> None:
    """Writes linear RGB with sRGB primaries, as 32-bit floats or as 16-bit ones.

    radiance: [H, W, 3]; NaN and Inf stay what they are
    half: to within 1 part in 2048; an image with a finite value that 16 bits cannot hold is written
        as 32-bit floats nevertheless

    Written atomically. Raises OSError with what to do where the disk is full.
    """
    _need_a_variant()
    pixels = radiance.detach().cpu().float().contiguous()
    bitmap = mi.Bitmap(pixels.numpy())
    if half and not ((pixels.abs() > LARGEST_HALF) & pixels.isfinite()).any():
        bitmap = bitmap.convert(component_format=mi.Struct.Type.Float16, srgb_gamma=False)
    stream = mi.MemoryStream()
    with a_worker_thread():
        bitmap.write(stream, mi.Bitmap.FileFormat.OpenEXR)
    write_atomically(path, stream.raw_buffer())


def read_exr(path: Path) -> Tensor:
    """[H, W, 3] float32 of what `write_exr` wrote.

    Raises DamagedError, naming the file, where it cannot be read or is something else.
    """
    _need_a_variant()
    try:
        with a_worker_thread():
            bitmap = mi.Bitmap(str(path))
        bitmap = bitmap.convert(component_format=mi.Struct.Type.Float32, srgb_gamma=False)
    except RuntimeError as error:
        raise DamagedError(f"{path} cannot be read ({error})") from error
    pixels = torch.from_numpy(np.array(bitmap))
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise DamagedError(f"{path} is no RGB image: it has the shape {list(pixels.shape)}")
    return pixels


def _need_a_variant() -> None:
    """Mitsuba has no bitmaps before one is chosen in this thread."""
    if mi.variant() is None:
        activate("scalar")
