"""`PatchLinear` layers as the pixels of one image see them: v has become part of their bias."""

from __future__ import annotations

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor

from ngi.machine.precision import multiplies_bfloat16
from ngi.models.patch_linear import PatchLinear, in_precision

ALIGNMENT = 8
"""Widths of inputs are padded to a multiple of this: matrix units read 16 bytes at a time."""


@dataclass(frozen=True)
class ImageLinear:
    """A layer for one v, in the precision of its products.

    Gives what `PatchLinear` gives in that precision, but in one product: its result is rounded
    once, where that of `PatchLinear` is rounded after each part of the sum.

    weight: [out, in], the last columns being those of `layer_inputs`; bias: [out]
    """

    weight: Tensor
    bias: Tensor

    @classmethod
    def of(cls, layer: PatchLinear, scene_vector: Tensor, precision: torch.dtype) -> ImageLinear:
        """scene_vector: [D] where the layer sees it."""
        *features, inputs, scene = layer.weight.split(layer.widths, dim=1)
        bias = F.linear(scene_vector[: layer.widths[-1]], scene, layer.bias)
        terms = len(in_precision(inputs, precision))
        weight = torch.cat([*features, _aligned(torch.cat([inputs] * terms, dim=1))], dim=1)
        return cls(weight.to(precision), bias.to(precision))

    def __call__(self, *parts: Tensor, negative_slope: float | None = None) -> Tensor:
        """Features, if any, and `layer_inputs` of p pixels to [p, out].

        negative_slope: see `activated_linear`
        """
        x = torch.cat(parts, dim=1)
        return activated_linear(x, self.weight, self.bias, negative_slope=negative_slope)


def activated_linear(
    x: Tensor, weight: Tensor, bias: Tensor | None, *, negative_slope: float | None
) -> Tensor:
    """As `F.linear`, with a leaky ReLU of this slope behind it, if any.

    On a CPU this is one call of oneDNN, the one that PyTorch's own compiler makes: it saves a pass
    over memory, and in float32 PyTorch would ask MKL, which is slow on AMD's processors.
    """
    if x.device.type == "cpu" and computed_by_onednn(x.dtype):
        after = ("none", []) if negative_slope is None else ("leaky_relu", [negative_slope])
        fused: Tensor = torch.ops.mkldnn._linear_pointwise(x, weight, bias, *after, "")
        return fused
    output = F.linear(x, weight, bias)
    return output if negative_slope is None else F.leaky_relu_(output, negative_slope)


def layer_inputs(x: Tensor, precision: torch.dtype) -> Tensor:
    """Inputs [p, channels] as layers take them: under bfloat16 two terms, whose sum they are."""
    return _aligned(torch.cat(in_precision(x, precision), dim=1))


def _aligned(columns: Tensor) -> Tensor:
    return F.pad(columns, (0, -columns.shape[1] % ALIGNMENT))


def computed_by_onednn(precision: torch.dtype) -> bool:
    """Whether oneDNN's fused layers are fast in this precision, and can be used here and now."""
    if torch.compiler.is_compiling():  # a file for other programs knows standard operators only
        return False
    if precision == torch.bfloat16:
        return multiplies_bfloat16("cpu")
    return precision == torch.float32 and torch.backends.mkldnn.is_available()
