"""A multilayer perceptron over pixels, with its own forward and backward pass.

PyTorch's layers write every intermediate result of a whole batch to memory and read it again, and
a network as small as ours then waits for memory most of the time. Here a few thousand pixels at a
time go through all layers, so that their features stay in the processor's caches; the inputs are
joined once, and each layer is one product with its bias and activation fused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import torch
import torch.nn.functional as F
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from ngi.models.image_layers import computed_by_onednn

CACHED_PIXELS = 2_048
"""That go through all layers together on a CPU."""
NEGATIVE_SLOPE = 0.01
"""Of the leaky ReLUs, as in the release."""


class PixelMLP(nn.Module):
    """Leaky ReLU layers on what differs from pixel to pixel, given what is the same in a patch.

    The scene vector enters at the first layer, as one bias per patch. The pixel features enter
    there and, joined to the hidden features, once more half way.

    pixel_features: I, numbers per pixel
    patch_features: D, numbers per patch; may be 0
    hidden_layers: number of layers with an activation
    """

    def __init__(
        self,
        *,
        pixel_features: int,
        patch_features: int,
        hidden_features: int,
        hidden_layers: int,
        out_features: int,
    ) -> None:
        super().__init__()
        self.skip = (hidden_layers + 1) // 2  # the layer that sees the pixel again
        first = nn.Linear(pixel_features + patch_features, hidden_features)
        of_pixels, of_patch = first.weight.detach().split([pixel_features, patch_features], dim=1)
        self.patch_weight = nn.Parameter(of_patch.clone())
        self.patch_bias = nn.Parameter(first.bias.detach())
        later = [
            nn.Linear(
                hidden_features + (pixel_features if number == self.skip else 0),
                hidden_features if number < hidden_layers else out_features,
            )
            for number in range(1, hidden_layers + 1)
        ]
        self.weights = nn.ParameterList(
            [nn.Parameter(of_pixels.clone()), *(layer.weight for layer in later)]
        )
        self.biases = nn.ParameterList([layer.bias for layer in later])

    def forward(self, pixels: Tensor, patch: Tensor) -> Tensor:
        """[n, p, I] and [n, D] to [n, p, out], in the precision of `pixels`.

        The products run in that precision, and gradients are summed up in that of the weights. A
        gradient reaches the weights and `patch`, and `pixels` where they want one.
        """
        patch_bias = F.linear(patch, self.patch_weight, self.patch_bias)
        arguments = (pixels.flatten(0, 1), patch_bias, self.skip, *self.weights, *self.biases)
        if torch.is_grad_enabled():
            output = _Layers.apply(*arguments)
        else:
            output, _, _ = _forward(*arguments)
        assert isinstance(output, Tensor)
        return output.unflatten(0, pixels.shape[:2])


class _Layers(torch.autograd.Function):
    """`_forward`, with a backward pass that goes through the same chunks of pixels."""

    @staticmethod
    def forward(
        ctx: Any, pixels: Tensor, patch_bias: Tensor, skip: int, *parameters: Tensor
    ) -> Tensor:
        output, weights, inputs = _forward(pixels, patch_bias, skip, *parameters)
        ctx.skip, ctx.layers, ctx.dtype = skip, len(weights), parameters[0].dtype
        ctx.save_for_backward(pixels, patch_bias, *weights, *inputs)
        return output

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        pixels, patch_bias, *saved = ctx.saved_tensors
        weights, inputs = saved[: ctx.layers], saved[ctx.layers :]
        hidden = len(weights[0])
        of_weights = [torch.zeros_like(weight, dtype=ctx.dtype) for weight in weights]
        of_biases = [weight.new_zeros(len(weight)) for weight in of_weights[1:]]
        of_patches, of_pixels = [], []
        chunks = _chunks(patch_bias, pixels, gradient.to(pixels.dtype))
        for index, (bias, part, g) in enumerate(chunks):
            of_part: Tensor | None = None
            for number in range(ctx.layers - 1, 0, -1):
                weight = weights[number]
                features = inputs[index * (ctx.layers - 1) + number - 1]
                of_weights[number] += g.mT @ features
                of_biases[number - 1] += g.sum(dim=0)
                if number == ctx.skip and ctx.needs_input_grad[0]:
                    of_part = g @ weight[:, hidden:]
                g = torch.ops.aten.leaky_relu_backward(
                    g @ weight[:, :hidden], features[:, :hidden], NEGATIVE_SLOPE, True
                )
            of_weights[0] += g.mT @ part
            of_patches.append(g.unflatten(0, (len(bias), -1)).sum(dim=1, dtype=ctx.dtype))
            if ctx.needs_input_grad[0]:
                assert of_part is not None
                of_pixels.append(of_part.add_(g @ weights[0]))
        return (
            torch.cat(of_pixels) if of_pixels else None,
            torch.cat(of_patches).to(patch_bias.dtype),
            None,
            *of_weights,
            *of_biases,
        )


def _forward(
    pixels: Tensor, patch_bias: Tensor, skip: int, *parameters: Tensor
) -> tuple[Tensor, list[Tensor], list[Tensor]]:
    """Pixels [n·p, I] to [n·p, out], with what a backward pass needs.

    patch_bias: [n, H], of the first layer
    parameters: weights of all layers, then biases of all but the first

    That is: the weights in the precision of the pixels, and, chunk by chunk, what each layer but
    the first was given.
    """
    layers = (len(parameters) + 1) // 2
    weights = [weight.to(pixels.dtype) for weight in parameters[:layers]]
    biases = [bias.to(pixels.dtype) for bias in parameters[layers:]]
    outputs, inputs = [], []
    for bias, part in _chunks(patch_bias.to(pixels.dtype), pixels):
        features = F.linear(part, weights[0]).unflatten(0, (len(bias), -1))
        features = F.leaky_relu_(features.add_(bias[:, None]), NEGATIVE_SLOPE).flatten(0, 1)
        for number in range(1, layers):
            if number == skip:
                features = torch.cat([features, part], dim=1)
            inputs.append(features)
            features = _layer(
                features, weights[number], biases[number - 1], activated=number < layers - 1
            )
        outputs.append(features)
    return torch.cat(outputs), weights, inputs


def _chunks(patch_bias: Tensor, *of_pixels: Tensor) -> Iterator[tuple[Tensor, ...]]:
    """Biases [m, H] of m whole patches at a time, and the rows of the others for their pixels."""
    patches = len(patch_bias)
    size = len(of_pixels[0]) // patches
    together = max(1, CACHED_PIXELS // size) if patch_bias.device.type == "cpu" else patches
    rows = [tensor.split(together * size) for tensor in of_pixels]
    return zip(patch_bias.split(together), *rows, strict=True)


def _layer(features: Tensor, weight: Tensor, bias: Tensor, *, activated: bool) -> Tensor:
    if features.device.type == "cpu" and computed_by_onednn(features.dtype):
        after: tuple[str, Sequence[float]] = ("none", [])
        if activated:
            after = ("leaky_relu", [NEGATIVE_SLOPE])
        fused: Tensor = torch.ops.mkldnn._linear_pointwise(features, weight, bias, *after, "")
        return fused
    output = F.linear(features, weight, bias)
    return F.leaky_relu_(output, NEGATIVE_SLOPE) if activated else output
