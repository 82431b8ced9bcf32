"""A multilayer perceptron over pixels, with its own forward and backward pass.

A network as small as ours waits for memory most of the time: every pass over the features of a
batch that can be saved counts. The inputs are joined once, each layer is one product with its bias
and activation fused, and what the first layer adds to all pixels of a patch is a column of its
weight, so that neither it nor its gradient takes a pass of its own.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import torch
import torch.nn.functional as F
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from ngi.models.image_layers import ALIGNMENT, activated_linear
from ngi.models.patch_linear import SampleGradients

NEGATIVE_SLOPE = 0.01
"""Of the leaky ReLUs, as in the release."""


class PixelMLP(nn.Module):
    """Leaky ReLU layers on what differs from pixel to pixel, given what is the same in a patch.

    The scene vector enters at the first layer, as one bias per patch. The pixel features enter
    there and, joined to the hidden features, once more half way.

    pixel_features: I, numbers per pixel
    patch_features: D, numbers per patch; may be 0
    hidden_layers: number of layers with an activation
    watcher: see `PatchLinear`
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
        self.watcher: SampleGradients | None = None
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
        arguments = (pixels, patch_bias, self.skip, *self.weights, *self.biases)
        if torch.is_grad_enabled():
            if self.watcher is not None:
                patch_bias.register_hook(partial(self._show_of_patches, self.watcher, patch))
            output = _Layers.apply(self.watcher, *arguments)  # type: ignore[no-untyped-call]
        else:
            output, _, _ = _forward(*arguments)
        by_patch: Tensor = output.unflatten(0, pixels.shape[:2])
        return by_patch

    @torch.no_grad()
    def at(self, patch: Tensor, precision: torch.dtype) -> Callable[[Tensor], Tensor]:
        """The same for any pixels of one patch [D]: [p, I] to [p, out], without a gradient.

        What all of an image's pieces share, the weights in `precision` and what the patch adds to
        the first layer's bias, is made once. Any number of threads may call it.
        """
        first = F.linear(patch, self.patch_weight, self.patch_bias)
        weights = [weight.to(precision) for weight in self.weights]
        biases = [bias.to(precision) for bias in (first, *self.biases)]
        return lambda pixels: _through_layers(pixels, pixels, self.skip, weights, biases)

    def _show_of_patches(self, watcher: SampleGradients, patch: Tensor, g: Tensor) -> None:
        """g: gradient of each patch's bias in the first layer, [n, H]; patch: [n, D]."""
        watcher(self.patch_bias, g)
        watcher(self.patch_weight, g[:, :, None] * patch.detach()[:, None])


class _Layers(torch.autograd.Function):
    """`_forward` with its backward pass."""

    @staticmethod
    def forward(
        ctx: Any,
        watcher: SampleGradients | None,
        pixels: Tensor,
        patch_bias: Tensor,
        skip: int,
        *parameters: Tensor,
    ) -> Tensor:
        output, weights, inputs = _forward(pixels, patch_bias, skip, *parameters)
        ctx.watcher, ctx.parameters, ctx.skip = watcher, parameters, skip
        ctx.shape = pixels.shape
        ctx.save_for_backward(*weights, *inputs)
        return output

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        layers = len(ctx.saved_tensors) // 2
        weights, inputs = ctx.saved_tensors[:layers], ctx.saved_tensors[layers:]
        patches, _, pixel_features = ctx.shape
        hidden = len(weights[0])
        of_weights, of_biases = [], []
        of_pixels: Tensor | None = None
        g = gradient.to(weights[0].dtype)
        for number in range(layers - 1, 0, -1):
            weight, bias = (ctx.parameters[i] for i in (number, layers + number - 1))
            of_biases.append(_of_bias(g, bias, patches, ctx.watcher))
            of_weights.append(_of_weight(g, inputs[number], weight, patches, ctx.watcher))
            if number == ctx.skip and ctx.needs_input_grad[1]:
                of_pixels = g @ weights[number][:, hidden:]
            g = g @ weights[number][:, :hidden]
            activated = inputs[number][:, :hidden]  # what came out of the activation
            torch.ops.aten.leaky_relu_backward.grad_input(
                g, activated, NEGATIVE_SLOPE, True, grad_input=g
            )
        of_first = _of_weight(g, inputs[0], ctx.parameters[0], patches, ctx.watcher)
        of_weights.append(of_first[:, :pixel_features])
        of_patches = of_first[:, pixel_features : pixel_features + patches].mT
        if of_pixels is not None:
            of_pixels = (of_pixels + g @ weights[0][:, :pixel_features]).view(ctx.shape)
        return None, of_pixels, of_patches, None, *reversed(of_weights), *reversed(of_biases)


def _of_weight(
    g: Tensor, features: Tensor, weight: Tensor, patches: int, watcher: SampleGradients | None
) -> Tensor:
    """Gradient [out, in] of a weight, from g, that of its layer's output, [n·p, out].

    features: what the layer was given, [n·p, in]; of a first layer they are more than the weight's
    """
    if watcher is None:
        return (g.mT @ features).to(weight.dtype)
    of_samples = (_per_patch(g, patches).mT @ _per_patch(features, patches)).to(weight.dtype)
    watcher(weight, of_samples[..., : weight.shape[1]])
    return of_samples.sum(dim=0)


def _of_bias(g: Tensor, bias: Tensor, patches: int, watcher: SampleGradients | None) -> Tensor:
    """Gradient [out] of a bias."""
    if watcher is None:
        return g.sum(dim=0).to(bias.dtype)
    of_samples = _per_patch(g, patches).sum(dim=1).to(bias.dtype)
    watcher(bias, of_samples)
    return of_samples.sum(dim=0)


def _per_patch(rows: Tensor, patches: int) -> Tensor:
    by_patch: Tensor = rows.unflatten(0, (patches, -1))
    return by_patch


def _forward(
    pixels: Tensor, patch_bias: Tensor, skip: int, *parameters: Tensor
) -> tuple[Tensor, list[Tensor], list[Tensor]]:
    """Pixels [n, p, I] to [n·p, out], with what a backward pass needs.

    patch_bias: [n, H], of the first layer
    parameters: weights of all layers, then biases of all but the first

    That is: the weights in the precision of the pixels, and what each layer was given. The first
    one's weight has a column for the bias of every patch, and a pixel has a 1 where its patch's is.
    """
    layers = (len(parameters) + 1) // 2
    first, *weights = [weight.to(pixels.dtype) for weight in parameters[:layers]]
    biases = [None, *(bias.to(pixels.dtype) for bias in parameters[layers:])]
    patches, size, width = pixels.shape
    columns = F.pad(patch_bias.mT.to(pixels.dtype), (0, -(width + patches) % ALIGNMENT))
    weights.insert(0, torch.cat([first, columns], dim=1))
    own = torch.eye(patches, columns.shape[1], dtype=pixels.dtype, device=pixels.device)
    inputs: list[Tensor] = []
    features = torch.cat([pixels, own[:, None].expand(-1, size, -1)], dim=-1).flatten(0, 1)
    output = _through_layers(features, pixels.flatten(0, 1), skip, weights, biases, inputs)
    return output, weights, inputs


def _through_layers(
    features: Tensor,
    pixels: Tensor,
    skip: int,
    weights: Sequence[Tensor],
    biases: Sequence[Tensor | None],
    inputs: list[Tensor] | None = None,
) -> Tensor:
    """What the last layer gives, [p, out].

    features: of the first layer; pixels: [p, I], joined to those of layer `skip`
    inputs: gets what each layer was given, if a list
    """
    for number, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        if number == skip:
            features = torch.cat([features, pixels], dim=1)
        if inputs is not None:
            inputs.append(features)
        slope = NEGATIVE_SLOPE if number < len(weights) - 1 else None
        features = activated_linear(features, weight, bias, negative_slope=slope)
    return features
