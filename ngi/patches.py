"""The data that flows from the renderer through exploration and reuse to the network.

Everything here is plain PyTorch; neither Mitsuba nor the network is known.

The state of a chain is a point of the unit hypercube of D + 2 dimensions: the D scene
variables v, then the two coordinates of the patch position (paper, Sec. 4 and 5.1).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import torch
from torch import Tensor

BUFFER_CHANNELS = {
    "position": 3,
    "normal": 3,
    "outgoing": 3,
    "albedo": 3,
    "roughness": 1,
    "emission": 3,
}
"""Every first-intersection buffer of the paper (Sec. 4.2) and its channels, in storage order."""

CHAIN_CHANNELS = {"throughput": 3, "chain_roughness": 1}
"""Buffers of the specular bounces where those are traced (paper, Fig. 10)."""

DIRECT_CHANNELS = {"direct": 3}
"""Buffer of the direct light where that is traced."""

LOG_RADIANCE = frozenset({"direct", "emission"})
"""Buffers of light: they hold log1p of its radiance."""

_STORED = {
    **{name: count for name, count in BUFFER_CHANNELS.items() if name != "emission"},
    **CHAIN_CHANNELS,
    **DIRECT_CHANNELS,
    "emission": BUFFER_CHANNELS["emission"],
}
"""All of them in storage order: emission is the last."""


@dataclass(frozen=True)
class BufferLayout:
    """Which buffers a scene carries, in storage order; by default those of the first hit.

    A scene in which a buffer can only be constant does not carry it. `position` is always there.

    - position: world position, normalised to [0, 1]^3 by the scene's fixed box
    - normal: shading normal n mapped by n / 2 + 1 / 2
    - outgoing: direction from the surface towards the camera, world space, in [-1, 1]
    - albedo: diffuse or specular reflectance, linear RGB in [0, 1]
    - roughness: GGX/Beckmann alpha; 0 for a perfectly smooth BSDF, 1 for a diffuse one
    - throughput: what the specular bounces before the surface let through, linear RGB from 0 up,
      1 where there is none
    - chain_roughness: sqrt(sum of alpha^2) over these bounces
    - direct: log1p of the direct light, the radiance that leaves the surface towards the camera
      after one bounce from an emitter, times the throughput, linear RGB
    - emission: log1p of the emitted radiance, linear RGB
    """

    names: tuple[str, ...] = tuple(BUFFER_CHANNELS)

    def __post_init__(self) -> None:
        expected = tuple(name for name in _STORED if name in self.names)
        if self.names != expected or "position" not in self.names:
            raise ValueError(
                f"buffers {list(self.names)}: expected 'position' and a selection of "
                f"{list(_STORED)} in that order"
            )

    @property
    def channels(self) -> int:
        """Number of channels of all buffers, emission included."""
        return sum(_STORED[name] for name in self.names)

    @property
    def input_channels(self) -> int:
        """Number of channels the network sees: all but emission, which is passed through."""
        return self.channels - (BUFFER_CHANNELS["emission"] if "emission" in self.names else 0)

    def slice(self, name: str) -> slice:
        """The channels of one buffer; raises KeyError where the scene does not carry it."""
        if name not in self.names:
            raise KeyError(f"this scene carries no buffer '{name}', only {list(self.names)}")
        start = 0
        for other in self.names:
            if other == name:
                break
            start += _STORED[other]
        return slice(start, start + _STORED[name])

    def adding(self, names: Iterable[str]) -> BufferLayout:
        """The layout that carries these buffers too."""
        together = {*self.names, *names}
        return BufferLayout(tuple(name for name in _STORED if name in together))


@dataclass(frozen=True)
class MovingPoints:
    """Where in the scene the K things are that variables move along; K may be 0.

    A translation is affine in v, so that point k is at weight[k] v + offset[k], normalised by the
    scene's box as the buffers' positions are.

    weight: [K, 3, D] float32. offset: [K, 3] float32.
    extent: [3] float32, the sides of the box relative to its longest one
    """

    weight: Tensor
    offset: Tensor
    extent: Tensor

    @classmethod
    def none(cls, dimensions: int) -> Self:
        """Of a scene of D = `dimensions` variables in which nothing is moved along."""
        return cls(torch.zeros(0, 3, dimensions), torch.zeros(0, 3), torch.ones(3))

    def of(self, components: Sequence[int]) -> Self:
        """For a v that holds only these components, all others of which move nothing."""
        return replace(self, weight=self.weight[:, :, list(components)])


COMPUTED_WITH = ("scene_vector", "buffers", "log_radiance")
"""The fields of `Patches` that networks compute with."""


def uploaded(tensor: Tensor, device: torch.device | str) -> Tensor:
    """The tensor on this device. Where that is a GPU, the host does not wait for it.

    A copy from memory that the system may move would be waited for, with all that is queued.
    """
    if tensor.device.type == "cpu" and torch.device(device).type == "cuda":
        return tensor.pin_memory().to(device, non_blocking=True)
    return tensor.to(device)


@dataclass(frozen=True)
class Patches:
    """n rendered patches of P x P pixels.

    scene_vector: [n, D] float32, v in [0, 1]^D, stored once per patch
    position: [n, 2] float32, patch position (x, y) in [0, 1]^2
    resolution: [n] int64, width and height in pixels of the virtual image the patch is cut from
    large_step: [n] bool, whether the chain came here by a large step
    buffers: [n, P, P, C] float32, channels as the scene's `BufferLayout` says
    log_radiance: [n, P, P, 3] float32, log1p of linear RGB radiance, finite
    """

    scene_vector: Tensor
    position: Tensor
    resolution: Tensor
    large_step: Tensor
    buffers: Tensor
    log_radiance: Tensor

    def __len__(self) -> int:
        return self.scene_vector.shape[0]

    def __getitem__(self, index: Tensor | slice) -> Self:
        return replace(self, **{f.name: getattr(self, f.name)[index] for f in fields(self)})

    def to(self, device: torch.device | str) -> Self:
        """What networks compute with, on this device; what only the host looks at stays."""
        moved = {name: uploaded(getattr(self, name), device) for name in COMPUTED_WITH}
        return replace(self, **moved)

    @classmethod
    def blank(cls, count: int, *, layout: BufferLayout, dimensions: int, patch_size: int) -> Self:
        """`count` black patches of a scene with D = `dimensions` variables."""
        pixels = (count, patch_size, patch_size)
        return cls(
            scene_vector=torch.zeros(count, dimensions),
            position=torch.zeros(count, 2),
            resolution=torch.full((count,), patch_size),
            large_step=torch.ones(count, dtype=torch.bool),
            buffers=torch.zeros(*pixels, layout.channels),
            log_radiance=torch.zeros(*pixels, 3),
        )
