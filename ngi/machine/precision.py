"""Which precision products are fastest in on this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import torch


def multiplies_bfloat16(device: str) -> bool:
    """Whether a device ('cpu', 'cuda') has units for products in bfloat16.

    A processor without them emulates them, up to ten times slower than fp32; oneDNN says that it
    takes bfloat16 on any with AVX-512.
    """
    import torch  # resolved from the configuration, which --help shows without PyTorch

    if device == "cuda":
        return bool(torch.cuda.is_bf16_supported(including_emulation=False))
    if not torch.ops.mkldnn._is_mkldnn_bf16_supported():
        return False
    units = torch.cpu.get_capabilities()
    on_x86 = units.get("architecture") == "x86_64"
    return not on_x86 or bool(units.get("avx512_bf16") or units.get("amx_bf16"))


def fast_precision(accelerator: str = "auto") -> str:
    """Lightning's 'bf16-mixed' where the processor or GPU computes in bfloat16, else '32-true'.

    accelerator: the trainer's; 'cpu' leaves a GPU out
    """
    device = "cuda" if trains_on_gpu(accelerator) else "cpu"
    return "bf16-mixed" if multiplies_bfloat16(device) else "32-true"


def trains_on_gpu(accelerator: str) -> bool:
    """Whether Lightning's trainer of this accelerator does, on this machine."""
    import torch

    return accelerator != "cpu" and torch.cuda.is_available()


def dtype_of(precision: str) -> torch.dtype:
    """What products are computed in under Lightning's 'bf16-mixed' or '32-true'."""
    import torch

    return torch.bfloat16 if precision == "bf16-mixed" else torch.float32


def shown_in(precision: str, device: str) -> torch.dtype:
    """What images are computed in of a network that was trained with this precision.

    Float32, which is the more exact one, where the device has no units for bfloat16.
    """
    import torch

    return dtype_of(precision) if multiplies_bfloat16(device) else torch.float32
