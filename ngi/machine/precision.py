"""Which precision products are fastest in on this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import torch


def multiplies_bfloat16(device: str) -> bool:
    """Whether a device ('cpu', 'cuda') has units for products in bfloat16.

    A processor without them emulates them, ten times slower than fp32.
    """
    import torch  # resolved from the configuration, which --help shows without PyTorch

    if device == "cuda":
        return bool(torch.cuda.is_bf16_supported(including_emulation=False))
    return bool(torch.ops.mkldnn._is_mkldnn_bf16_supported())


def fast_precision() -> str:
    """Lightning's 'bf16-mixed' where the processor or GPU computes in bfloat16, else '32-true'."""
    import torch

    device = "cuda" if torch.cuda.is_available() else "cpu"
    return "bf16-mixed" if multiplies_bfloat16(device) else "32-true"


def dtype_of(precision: str) -> torch.dtype:
    """What products are computed in under Lightning's 'bf16-mixed' or '32-true'."""
    import torch

    return torch.bfloat16 if precision == "bf16-mixed" else torch.float32
