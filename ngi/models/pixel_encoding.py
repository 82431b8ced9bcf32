"""What a network is given of a pixel: the stored buffers, and what follows from them."""

import math

import torch
from torch import Tensor, nn

from ngi.models.image_layers import ALIGNMENT
from ngi.patches import BufferLayout, MovingPoints

NEAR = 1e-3
"""Distance to a moving point below which no direction towards it is told apart from none."""


class PixelEncoding(nn.Module):
    """Buffers, the position's sines and cosines, the reflected direction and the cosine n·ωo.

    A small network learns low frequencies of its inputs first (Rahaman et al. 2019); sines and
    cosines of the position give it higher ones (Tancik et al. 2020). What a glossy surface shows
    depends on the reflected direction 2 (n·ωo) n − ωo rather than on n and ωo by themselves.
    What a light or an object adds depends on where it stands from here rather than on where both
    stand in the scene. Nothing of it is stored: it is computed from the buffers and v.

    layout: the buffers of the scene; emission is no input
    octaves: sin and cos of 2^k π (p − 1/2) for k from 0 to octaves − 1, p being the position in
        [0, 1]; 0 for none
    directions: whether the reflected direction and the cosine are given
    moving: of each of its points the offset from the pixel's, its length and direction, and where
        the scene has normals its cosine n·ω
    """

    _weight: Tensor
    _offset: Tensor
    _extent: Tensor

    def __init__(
        self, *, layout: BufferLayout, octaves: int, directions: bool, moving: MovingPoints
    ) -> None:
        super().__init__()
        if octaves < 0:
            raise ValueError(f"model.octaves is {octaves}: it cannot be negative")
        needed = {"normal", "outgoing"} - set(layout.names)
        if directions and needed:
            raise ValueError(
                f"model.directions is true, and the scene's buffers {list(layout.names)} lack "
                f"{sorted(needed)}: set model.directions=false"
            )
        self._layout = layout
        self._octaves = octaves
        self._directions = directions
        self._points, _, self._components = moving.weight.shape
        for name in ("weight", "offset", "extent"):
            value = getattr(moving, name)
            # A network that is told of none is on disk what it was without them.
            self.register_buffer(f"_{name}", value, persistent=self._points > 0)

    @property
    def features(self) -> int:
        """Numbers per pixel that the network is given."""
        buffers = torch.zeros(1, 1, self._layout.channels)
        encoded: Tensor = self(buffers, torch.zeros(1, self._components), torch.float32)
        return encoded.shape[-1]

    def forward(self, buffers: Tensor, scene_vector: Tensor, precision: torch.dtype) -> Tensor:
        """Buffers [n, p, C] in float32 and v [n, D] to features [n, p, I] in `precision`.

        Rounded to bfloat16 a position alone would move by up to 1/1024 of the scene's box; the
        sines and cosines are made before anything is rounded, and the highest of four octaves
        tells 1/4000 of the box apart. The number of features is a multiple of 8.
        """
        position = 2 * buffers[..., self._layout.slice("position")] - 1
        others = buffers[..., position.shape[-1] : self._layout.input_channels]
        parts = [position, others, *self._waves(position)]
        normal = None
        if "normal" in self._layout.names:
            normal = 2 * buffers[..., self._layout.slice("normal")] - 1
        if self._directions:
            assert normal is not None
            outgoing = buffers[..., self._layout.slice("outgoing")]
            cosine = (normal * outgoing).sum(dim=-1, keepdim=True)
            parts += [2 * cosine * normal - outgoing, cosine]
        if self._points:
            parts += self._relative(position, normal, scene_vector)
        width = sum(part.shape[-1] for part in parts)
        parts.append(position.new_zeros(*position.shape[:-1], -width % ALIGNMENT))
        return torch.cat([part.to(precision) for part in parts], dim=-1)

    def _waves(self, position: Tensor) -> list[Tensor]:
        """Of a position in [-1, 1]; sin 2x = 2 sin x cos x, cos 2x = 1 − 2 sin²x."""
        if self._octaves == 0:
            return []
        half_turn = math.pi / 2 * position
        sine, cosine = torch.sin(half_turn), torch.cos(half_turn)
        waves = [sine, cosine]
        for _ in range(self._octaves - 1):
            sine, cosine = 2 * sine * cosine, 1 - 2 * sine * sine
            waves += [sine, cosine]
        return waves

    def _relative(
        self, position: Tensor, normal: Tensor | None, scene_vector: Tensor
    ) -> list[Tensor]:
        """Of a position in [-1, 1], [n, p, 3]; lengths in units of half the box's longest side."""
        parts = []
        for weight, offset in zip(self._weight, self._offset, strict=True):
            point = 2 * (scene_vector @ weight.mT + offset) - 1
            away = (point[:, None] - position) * self._extent
            distance = torch.linalg.vector_norm(away, dim=-1, keepdim=True)
            direction = away / distance.clamp_min(NEAR)
            parts += [away, distance, direction]
            if normal is not None:
                parts.append((normal * direction).sum(dim=-1, keepdim=True))
        return parts
