"""A linear layer in which what is constant over a patch costs as much as a bias."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import torch
import torch.nn.functional as F
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

SampleGradients = Callable[[Tensor, Tensor], None]
"""Is shown a parameter, once, and its gradients for n samples, [n, *parameter.shape]."""


class PatchLinear(nn.Linear):
    """`nn.Linear` on the concatenation [pixel features..., v] of every pixel of n patches.

    Its parameters and their initialisation are those of `nn.Linear` on the concatenation, and so
    is its result. The concatenation is never formed: each part meets its own columns of the
    weight, and the part of the scene vector v, which is constant over a patch, is one bias per
    patch. (The release repeats v at every pixel.)

    weight: [out_features, sum(pixel_features) + scene_dimensions]; bias: [out_features]
    watcher: while set at the forward pass, the backward pass forms the gradients of each sample,
        in the precision of the products, shows them to it and sums them up to those of the batch
    """

    def __init__(
        self, *, pixel_features: Sequence[int], scene_dimensions: int, out_features: int
    ) -> None:
        super().__init__(sum(pixel_features) + scene_dimensions, out_features)
        self.widths = (*pixel_features, scene_dimensions)
        self.watcher: SampleGradients | None = None

    def forward(self, pixels: Sequence[Tensor], scene_vector: Tensor) -> Tensor:  # type: ignore[override]
        """Tensors [n, p, features] for p pixels per patch and v [n, D] to [n, p, out_features].

        Under autocast the products run in the lower precision, but inputs that come in full
        precision are not rounded to it: bfloat16 would move positions by up to 1/512 of the
        scene's box, and would take two scenes for one.
        """
        if self.watcher is None:
            return _patch_linear(self.weight, self.bias, scene_vector, pixels)
        output = _Watched.apply(self.watcher, self.weight, self.bias, *pixels, scene_vector)  # type: ignore[no-untyped-call]
        assert isinstance(output, Tensor)
        return output


class _Watched(torch.autograd.Function):
    """`_patch_linear`, with a backward pass that has the gradients of each sample.

    Their sum is the gradient of the batch, so that they cost no product of their own.
    """

    @staticmethod
    def forward(
        ctx: Any,
        watcher: SampleGradients,
        weight: Tensor,
        bias: Tensor,
        *inputs: Tensor,
    ) -> Tensor:
        ctx.show_weights, ctx.show_biases = partial(watcher, weight), partial(watcher, bias)
        ctx.save_for_backward(weight, *inputs)
        *pixels, scene_vector = inputs
        return _patch_linear(weight, bias, scene_vector, pixels)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        weight, *pixels, scene_vector = ctx.saved_tensors
        biases = gradient.sum(dim=1).to(weight.dtype)
        weights = _sample_gradients(gradient, biases, scene_vector, pixels)
        ctx.show_weights(weights)
        ctx.show_biases(biases)
        of_inputs = [
            of_output @ columns.to(of_output.dtype) if needed else None
            for of_output, columns, needed in zip(
                (*[gradient] * len(pixels), biases),
                weight.split(_widths(scene_vector, pixels), dim=1),
                ctx.needs_input_grad[3:],
                strict=True,
            )
        ]
        return None, weights.sum(dim=0), biases.sum(dim=0), *of_inputs


def _patch_linear(
    weight: Tensor, bias: Tensor, scene_vector: Tensor, pixels: Sequence[Tensor]
) -> Tensor:
    *weights, scene_weight = weight.split(_widths(scene_vector, pixels), dim=1)
    output = _linear(pixels[0], weights[0])
    for part, columns in zip(pixels[1:], weights[1:], strict=True):
        output += _linear(part, columns)
    with torch.autocast(scene_vector.device.type, enabled=False):
        patch_bias = F.linear(scene_vector, scene_weight, bias)
    output += patch_bias[:, None].to(output.dtype)
    return output


def _sample_gradients(
    gradient: Tensor, biases: Tensor, scene_vector: Tensor, pixels: Sequence[Tensor]
) -> Tensor:
    """Gradients of the weight for each sample, [n, out_features, in_features].

    For the columns of pixel features they are gradientᵀ · features, all in one product; for those
    of v, the same at every pixel, an outer product.
    gradient: of the output, [n, p, out_features]; biases: its sum over the pixels
    """
    parts = [in_precision(part, gradient.dtype) for part in pixels]
    products = gradient.mT @ torch.cat([term for terms in parts for term in terms], dim=-1)
    of_parts = products.split([sum(term.shape[-1] for term in terms) for terms in parts], dim=-1)
    weights = biases.new_empty(*biases.shape, sum(_widths(scene_vector, pixels)))
    *of_pixels, of_scene = weights.split(_widths(scene_vector, pixels), dim=-1)
    for columns, of_part, terms in zip(of_pixels, of_parts, parts, strict=True):
        first, *rest = of_part.chunk(len(terms), dim=-1)
        columns.copy_(first)
        for of_term in rest:
            columns += of_term
    torch.mul(biases[:, :, None], scene_vector[:, None], out=of_scene)
    return weights


def _widths(scene_vector: Tensor, pixels: Sequence[Tensor]) -> list[int]:
    return [*(part.shape[-1] for part in pixels), scene_vector.shape[-1]]


def _linear(x: Tensor, weight: Tensor) -> Tensor:
    """Product x · weightᵀ; under autocast, float32 x enters as the sum of two numbers."""
    precision = product_precision(x)
    if precision != x.dtype:
        terms = in_precision(x, precision)
        return F.linear(torch.cat(terms, dim=-1), torch.cat([weight, weight], dim=1))
    return F.linear(x, weight)


def product_precision(x: Tensor) -> torch.dtype:
    """Of products with x: autocast's where it is on and x is float32, else x's own."""
    device = x.device.type
    if torch.is_autocast_enabled(device) and x.dtype == torch.float32:
        return torch.get_autocast_dtype(device)
    return x.dtype


def in_precision(x: Tensor, dtype: torch.dtype) -> list[Tensor]:
    """Tensors of this precision whose sum is x: where x is more precise, two of them."""
    if x.dtype == dtype:
        return [x]
    high = x.to(dtype)
    return [high, (x - high).to(high.dtype)]
