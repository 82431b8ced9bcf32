"""Our neural renderer: encoded buffers and scene vector to radiance, per pixel."""

import torch
from torch import Tensor, nn

from ngi.models.generator_inputs import check_inputs, check_sizes
from ngi.models.known_light import add_known_light
from ngi.models.parallel import in_parallel
from ngi.models.patch_linear import product_precision
from ngi.models.pixel_encoding import PixelEncoding
from ngi.models.pixel_generator import CACHED_PIXELS, MANY_PIXELS, RADIANCE_CHANNELS
from ngi.models.pixel_mlp import PixelMLP
from ngi.patches import BufferLayout, MovingPoints


class EncodedGenerator(nn.Module):
    """The same function as the paper's `PixelGenerator`, cheaper per step and quicker to learn.

    Every pixel is encoded (`PixelEncoding`). The first layer sees the encoded pixel and v, the one
    half way sees the pixel again (`PixelMLP`); in the paper all layers but the first see both.
    Emission and direct light are added to the output (`add_known_light`).

    layout: the buffers of the scene
    scene_dimensions: D, the length of v; may be 0
    hidden_features, hidden_layers: width of the hidden layers and their number
    octaves, directions: see `PixelEncoding`
    relative: whether it is told where each pixel is relative to what moves
    moving: what moves, as a function of the vector that it is given

    Under autocast everything between the encoding and the output is in the lower precision.
    """

    linear_emission = False
    """See `add_known_light`."""

    def __init__(
        self,
        *,
        layout: BufferLayout,
        scene_dimensions: int,
        hidden_features: int,
        hidden_layers: int,
        octaves: int,
        directions: bool,
        relative: bool = False,
        moving: MovingPoints | None = None,
    ) -> None:
        super().__init__()
        check_sizes(hidden_features=hidden_features, hidden_layers=hidden_layers)
        self.layout = layout
        self.scene_dimensions = scene_dimensions
        if not relative or moving is None:
            moving = MovingPoints.none(scene_dimensions)
        self.encoding = PixelEncoding(
            layout=layout, octaves=octaves, directions=directions, moving=moving
        )
        self.mlp = PixelMLP(
            pixel_features=self.encoding.features,
            patch_features=scene_dimensions,
            hidden_features=hidden_features,
            hidden_layers=hidden_layers,
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
        pixels, precision = buffers.flatten(1, 2), product_precision(buffers)
        with torch.autocast(pixels.device.type, enabled=False):
            encoded = self.encoding(pixels, scene_vector, precision)
            output: Tensor = self.mlp(encoded, scene_vector)
        output = output.to(pixels.dtype).unflatten(1, buffers.shape[1:3])
        return self._with_known_light(output, buffers)

    @torch.no_grad()
    def render(self, buffers: Tensor, scene_vector: Tensor) -> Tensor:
        """A whole image, [H, W, C] and v [D] to log1p radiance [H, W, 3]; keeps no gradient."""
        check_inputs(
            buffers[None],
            scene_vector[None],
            layout=self.layout,
            scene_dimensions=self.scene_dimensions,
        )
        precision, pixels = product_precision(buffers), buffers.flatten(0, 1)

        def output_of(chunk: Tensor) -> Tensor:
            encoded = self.encoding(chunk[None], scene_vector[None], precision)[0]
            return of_pixels(encoded).to(chunk.dtype)

        with torch.autocast(buffers.device.type, enabled=False):
            of_pixels = self.mlp.at(scene_vector, precision)
            if buffers.device.type == "cpu":
                output = torch.cat(in_parallel(output_of, pixels.split(CACHED_PIXELS)))
            else:
                output = torch.cat([output_of(chunk) for chunk in pixels.split(MANY_PIXELS)])
        return self._with_known_light(output.unflatten(0, buffers.shape[:2]), buffers)

    def _with_known_light(self, output: Tensor, buffers: Tensor) -> Tensor:
        linear = self.linear_emission
        return add_known_light(output, buffers, self.layout, linear_emission=linear)


class LinearEmissionGenerator(EncodedGenerator):
    """The same, with emission added as radiance; ours."""

    linear_emission = True
