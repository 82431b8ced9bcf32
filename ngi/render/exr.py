"""OpenEXR files of linear radiance."""

from __future__ import annotations

from pathlib import Path

from torch import Tensor

from ngi.backend import activate, mi


def write_exr(path: Path, radiance: Tensor) -> None:
    """radiance: [H, W, 3] linear RGB with sRGB primaries; written as 32-bit floats."""
    if mi.variant() is None:
        activate("scalar")
    mi.Bitmap(radiance.detach().cpu().float().contiguous().numpy()).write(str(path))
