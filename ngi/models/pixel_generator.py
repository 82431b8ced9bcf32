"""The neural renderer: from first-intersection buffers and scene vector to radiance, per pixel."""

from collections.abc import Sequence

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from ngi.models.generator_inputs import check_inputs, check_sizes
from ngi.models.image_layers import ImageLinear, layer_inputs
from ngi.models.known_light import add_known_light
from ngi.models.patch_linear import PatchLinear, product_precision
from ngi.patches import BufferLayout

RADIANCE_CHANNELS = 3
CACHED_PIXELS = 8_192
"""Rendered at a time on a CPU: the features of so many stay in its caches."""
MANY_PIXELS = 65_536
"""Rendered at a time on a GPU."""


class PixelGenerator(nn.Module):
    """Per-pixel multilayer perceptron with skip connections (paper, Sec. 4.2).

    The position buffer alone goes through the first layer; every later layer, the output layer
    included, sees [hidden features, all buffers, v]. Emission is no input: it is passed through,
    and direct light, where the buffers hold it, is added to the output too (`add_known_light`).

    layout: the buffers of the scene
    scene_dimensions: D, the length of the scene vector v; may be 0
    hidden_features: width of every hidden layer
    hidden_layers: number of layers with an activation, the position's included. The release
        counts only what comes after its first two: its "8" is 10 here (9 without preconditioning)
    position_preconditioning: False lets the first layer see [all buffers, v] (paper's ablation)
    negative_slope: of the leaky ReLUs; the release's is PyTorch's default

    Under autocast the inputs keep their precision (see `PatchLinear`), while hidden features and
    the result are rounded, with bfloat16 by at most 1/256 of their value. The release knows
    float32 only.
    """

    def __init__(
        self,
        *,
        layout: BufferLayout,
        scene_dimensions: int,
        hidden_features: int = 512,
        hidden_layers: int = 8,
        position_preconditioning: bool = True,
        negative_slope: float = 0.01,
    ) -> None:
        super().__init__()
        if scene_dimensions < 0:
            raise ValueError(f"scene_dimensions is {scene_dimensions}: it cannot be negative")
        check_sizes(hidden_features=hidden_features, hidden_layers=hidden_layers)
        if negative_slope < 0:
            raise ValueError(f"model.negative_slope is {negative_slope}: it cannot be negative")
        self.layout = layout
        self.scene_dimensions = scene_dimensions
        self.position_preconditioning = position_preconditioning
        self.negative_slope = negative_slope
        inputs = layout.input_channels
        if position_preconditioning:
            position = layout.slice("position")
            self.input_layer = PatchLinear(
                pixel_features=[position.stop - position.start],
                scene_dimensions=0,
                out_features=hidden_features,
            )
        else:
            self.input_layer = PatchLinear(
                pixel_features=[inputs],
                scene_dimensions=scene_dimensions,
                out_features=hidden_features,
            )
        self.hidden = nn.ModuleList(
            PatchLinear(
                pixel_features=[hidden_features, inputs],
                scene_dimensions=scene_dimensions,
                out_features=hidden_features,
            )
            for _ in range(hidden_layers - 1)
        )
        self.output_layer = PatchLinear(
            pixel_features=[hidden_features, inputs],
            scene_dimensions=scene_dimensions,
            out_features=RADIANCE_CHANNELS,
        )

    def forward(self, buffers: Tensor, scene_vector: Tensor) -> Tensor:
        """log1p of linear RGB radiance, [n, H, W, 3], of the buffers' dtype.

        buffers: [n, H, W, C], channels as the layout says
        scene_vector: [n, D] in [0, 1]
        Raises ValueError where these shapes do not fit.
        """
        check_inputs(
            buffers, scene_vector, layout=self.layout, scene_dimensions=self.scene_dimensions
        )
        pixels = buffers.flatten(1, 2)
        inputs = pixels[..., : self.layout.input_channels]  # emission is the last of the buffers
        features = self._activate(self._first_layer(pixels, inputs, scene_vector))
        for layer in self.hidden:
            features = self._activate(layer((features, inputs), scene_vector))
        output = self.output_layer((features, inputs), scene_vector).to(buffers.dtype)
        return add_known_light(output.unflatten(1, buffers.shape[1:3]), buffers, self.layout)

    @torch.no_grad()
    def render(self, buffers: Tensor, scene_vector: Tensor) -> Tensor:
        """A whole image, [H, W, C] and v [D] to log1p radiance [H, W, 3], in chunks of pixels.

        The same as `forward` up to rounding, which under bfloat16 happens less often here (see
        `ImageLinear`). The chunks bound the memory and do not change the result. Keeps no gradient.
        """
        check_inputs(
            buffers[None],
            scene_vector[None],
            layout=self.layout,
            scene_dimensions=self.scene_dimensions,
        )
        device, precision = buffers.device.type, product_precision(self.input_layer.weight)
        size = CACHED_PIXELS if device == "cpu" else MANY_PIXELS
        with torch.autocast(device, enabled=False):
            layers = [
                ImageLinear.of(layer, scene_vector, precision)
                for layer in self.modules()
                if isinstance(layer, PatchLinear)
            ]
            chunks = buffers.flatten(0, 1).split(size)
            output = torch.cat([self._render_pixels(chunk, layers) for chunk in chunks])
        output = output.to(buffers.dtype).unflatten(0, buffers.shape[:2])
        return add_known_light(output, buffers, self.layout)

    def _render_pixels(self, pixels: Tensor, layers: Sequence[ImageLinear]) -> Tensor:
        """Buffers [p, C] to the last layer's output [p, 3]."""
        first, *hidden, last = layers
        precision = first.weight.dtype
        inputs = layer_inputs(pixels[:, : self.layout.input_channels], precision)
        seen_first = inputs
        if self.position_preconditioning:
            seen_first = layer_inputs(pixels[:, self.layout.slice("position")], precision)
        features = first(seen_first, negative_slope=self.negative_slope)
        for layer in hidden:
            features = layer(features, inputs, negative_slope=self.negative_slope)
        return last(features, inputs)

    def _first_layer(self, pixels: Tensor, inputs: Tensor, scene_vector: Tensor) -> Tensor:
        seen = inputs
        if self.position_preconditioning:
            seen, scene_vector = pixels[..., self.layout.slice("position")], scene_vector[:, :0]
        features: Tensor = self.input_layer((seen,), scene_vector)
        return features

    def _activate(self, features: Tensor) -> Tensor:
        # In place: PatchLinear's output is kept by nobody else, and memory traffic is what a
        # step spends beside its matrix products.
        return F.leaky_relu(features, self.negative_slope, inplace=True)
