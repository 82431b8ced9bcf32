"""The network of Compositional Neural Scene Representations (CNSR), a method to compare with."""

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from ngi.models.pixel_generator import RADIANCE_CHANNELS, PixelGenerator
from ngi.patches import BufferLayout

CAMERA_NUMBERS = 6
"""Origin and direction."""
REDUCTION = 4
"""Pixels of an observation along a pixel of the encoder's last features."""


class ObservationEncoder(nn.Module):
    """What an observation says of the scene, as one vector (Granskog et al. 2020, Sec. 3).

    The "pool" encoder of their program, which has it from Eslami et al. 2018: eight convolutions
    in two blocks with a skip connection each, the camera joined to the second, and a mean over
    the pixels.

    channels: of an observation, buffers and radiance together
    features: of the vector, even
    """

    def __init__(self, *, channels: int, features: int) -> None:
        super().__init__()
        half, joined = features // 2, features + CAMERA_NUMBERS
        self.halve = nn.Conv2d(channels, features, 2, stride=2)
        self.first_skip = nn.Conv2d(features, features, 2, stride=2)
        self.first = nn.Conv2d(features, half, 3, padding=1)
        self.quarter = nn.Conv2d(half, features, 2, stride=2)
        self.second_skip = nn.Conv2d(joined, features, 3, padding=1)
        self.second = nn.Conv2d(joined, half, 3, padding=1)
        self.third = nn.Conv2d(half, features, 3, padding=1)
        self.last = nn.Conv2d(features, features, 1)

    def forward(self, observations: Tensor, cameras: Tensor) -> Tensor:
        """[m, P, P, channels] and their cameras [m, 6] to [m, features]."""
        halved = F.relu(self.halve(observations.movedim(-1, 1)))
        x = F.relu(self.quarter(F.relu(self.first(halved)))) + F.relu(self.first_skip(halved))
        everywhere = cameras[..., None, None].expand(-1, -1, *x.shape[2:])
        joined = torch.cat([x, everywhere.to(x.dtype)], dim=1)
        x = F.relu(self.third(F.relu(self.second(joined)))) + F.relu(self.second_skip(joined))
        return F.relu(self.last(x)).mean(dim=(2, 3))


class CNSR(nn.Module):
    """Tells radiance from buffers and a few path-traced observations of the scene, not from v.

    Compositional Neural Scene Representations for Shading Inference (Granskog et al. 2020), as far
    as the paper compares with it (Sec. 7.2.2): every observation, with its buffers and camera, is
    encoded; the mean of the codes and the query's camera stand where the `PixelGenerator` has v.

    layout: the buffers of the scene
    hidden_features, hidden_layers: of the generator; their program's 512 and, with the layer that
        their count of 10 leaves out, 11. The representation has half as many numbers: their 256

    It differs from their program in this: observations hold every buffer of the scene and log1p
    radiance (theirs: normal, position, object number, linear radiance); a camera is its origin and
    direction, 6 numbers for their 16; the generator's output layer sees the buffers too, emission
    is passed through, and there is no ReLU behind it. The representation is not partitioned into
    lighting, geometry and material, which needs batches in which only one of them varies, and is
    there to edit scenes, not for the quality.
    """

    def __init__(
        self,
        *,
        layout: BufferLayout,
        hidden_features: int = 512,
        hidden_layers: int = 11,
    ) -> None:
        super().__init__()
        if hidden_features < 4 or hidden_features % 4:
            raise ValueError(
                f"model.hidden_features is {hidden_features}: the encoder has layers half and a "
                "quarter as wide; give a multiple of 4"
            )
        self.channels = layout.channels + RADIANCE_CHANNELS
        self.encoder = ObservationEncoder(channels=self.channels, features=hidden_features // 2)
        self.generator = PixelGenerator(
            layout=layout,
            scene_dimensions=hidden_features // 2 + CAMERA_NUMBERS,
            hidden_features=hidden_features,
            hidden_layers=hidden_layers,
            position_preconditioning=False,
        )

    def forward(
        self, buffers: Tensor, camera: Tensor, observations: Tensor, cameras: Tensor
    ) -> Tensor:
        """log1p of linear RGB radiance, [n, H, W, 3], of the query.

        buffers: [n, H, W, C] of the query; camera: [n, 6], its origin in units of the scene's box
            and its unit direction
        observations: [n, k, P, P, C + 3], buffers and log1p radiance of each; P is a multiple of 4
        cameras: [n, k, 6] of the observations
        Raises ValueError where these shapes do not fit.
        """
        representation = self.represent(observations, cameras)
        output: Tensor = self.generator(buffers, torch.cat([representation, camera], dim=-1))
        return output

    def represent(self, observations: Tensor, cameras: Tensor) -> Tensor:
        """The scene as the observations show it, [n, hidden_features / 2]; see `forward`."""
        n, k, height, width, channels = observations.shape
        if channels != self.channels or height % REDUCTION or width % REDUCTION:
            raise ValueError(
                f"observations of {height} x {width} pixels with {channels} channels: expected "
                f"{self.channels}, and sides that {REDUCTION} divides (renderer.patch_size)"
            )
        if cameras.shape != (n, k, CAMERA_NUMBERS):
            raise ValueError(
                f"cameras of shape {list(cameras.shape)}: expected {[n, k, CAMERA_NUMBERS]}"
            )
        codes = self.encoder(observations.flatten(0, 1), cameras.flatten(0, 1))
        of_images: Tensor = codes.unflatten(0, (n, k)).to(cameras.dtype)
        return of_images.mean(dim=1)

    @torch.no_grad()
    def render(
        self, buffers: Tensor, camera: Tensor, observations: Tensor, cameras: Tensor
    ) -> Tensor:
        """A whole image, [H, W, 3] log1p radiance; the arguments of `forward` without the axis n.

        See `PixelGenerator.render`.
        """
        representation = self.represent(observations[None], cameras[None])[0]
        return self.generator.render(buffers, torch.cat([representation, camera]))
