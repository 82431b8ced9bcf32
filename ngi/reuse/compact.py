"""Patches as they are kept: 45 KB for a 32 x 32 patch with all 16 channels."""

from dataclasses import dataclass, fields, replace
from typing import Self

import torch
from torch import Tensor

from ngi.patches import BufferLayout, Patches, uploaded

ON_DEVICE = ("scene_vector", "world_position", "other_buffers", "log_radiance")
"""What networks compute with. The host decides by everything else, which stays with it."""


@dataclass(frozen=True)
class CompactPatches:
    """n patches of which all but the world position is kept in half precision.

    scene_vector: [n, D] float32
    position: [n, 2] float32, patch position
    resolution: [n] int64
    large_step: [n] bool
    world_position: [n, P, P, 3] float32; half precision has steps of 1/2048 below 1, a third of a
        pixel where an image of 600 x 600 shows the whole scene, more where it shows a part
    other_buffers: [n, P, P, C - 3] float16
    log_radiance: [n, P, P, 3] float16

    Rounding to half precision changes a number x by at most 2^-11 |x| (2^-25 below 2^-14). As
    measured over log radiances of 0 to 11 (radiances up to 60,000), that is at most 3.9e-3 in log
    radiance, and 4.9e-4 below a radiance of 6.4 (log radiance 2). Buffers in [-1, 1] change by
    at most 2.5e-4.
    """

    scene_vector: Tensor
    position: Tensor
    resolution: Tensor
    large_step: Tensor
    world_position: Tensor
    other_buffers: Tensor
    log_radiance: Tensor

    @classmethod
    def compress(
        cls, patches: Patches, layout: BufferLayout, *, device: torch.device | str = "cpu"
    ) -> Self:
        """Raises ValueError for buffers of another layout, NaN, Inf and what is above 65,504.

        device: of `ON_DEVICE`; the rest is on the CPU
        """
        if patches.buffers.shape[-1] != layout.channels:
            raise ValueError(
                f"buffers: {patches.buffers.shape[-1]} channels: the scene's buffers "
                f"{list(layout.names)} have {layout.channels}"
            )
        world_position = patches.buffers[..., layout.slice("position")]
        other_buffers = patches.buffers[..., layout.slice("position").stop :]
        compact = cls(
            scene_vector=_keep(patches.scene_vector, torch.float32, device),
            position=_keep(patches.position, torch.float32),
            resolution=_keep(patches.resolution, torch.int64),
            large_step=_keep(patches.large_step, torch.bool),
            world_position=_keep(world_position.contiguous(), torch.float32, device),
            other_buffers=_keep(other_buffers, torch.float16, device),
            log_radiance=_keep(patches.log_radiance, torch.float16, device),
        )
        lengths = {name: len(tensor) for name, tensor in compact.tensors().items()}
        if len(set(lengths.values())) != 1:
            raise ValueError(f"patches: parts differ in number: {lengths}; give one per patch")
        images = ("world_position", "other_buffers", "log_radiance")
        found = [getattr(compact, name).isfinite().flatten(1).all(1) for name in images]
        for name, finite in zip(images, torch.stack(found).cpu(), strict=True):
            if not finite.all():
                raise ValueError(
                    f"patches {(~finite).nonzero().flatten().tolist()}: {name} holds NaN, Inf or "
                    "numbers above 65504: the renderer must repair or mask such pixels"
                )
        return compact

    def to(self, device: torch.device | str) -> Self:
        """With `ON_DEVICE` there."""
        return replace(self, **{name: uploaded(getattr(self, name), device) for name in ON_DEVICE})

    def expand(self) -> Patches:
        """The patches in float32, in memory of their own."""
        buffers = torch.cat([self.world_position, self.other_buffers.float()], dim=-1)
        return Patches(
            scene_vector=self.scene_vector.clone(),
            position=self.position.clone(),
            resolution=self.resolution.clone(),
            large_step=self.large_step.clone(),
            buffers=buffers,
            log_radiance=self.log_radiance.float(),
        )

    def __len__(self) -> int:
        return self.scene_vector.shape[0]

    @property
    def bytes_on_device(self) -> float:
        """Of one patch."""
        tensors = self.tensors()
        return sum(tensors[name].nbytes for name in ON_DEVICE) / len(self)

    def tensors(self) -> dict[str, Tensor]:
        """The fields by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


class PatchBlocks:
    """An array of compact patches that grows block by block, so that growing copies nothing.

    capacity: number of slots it can grow to; slot i is row i mod `rows` of block i div `rows`
    """

    rows = 64

    def __init__(self, *, capacity: int) -> None:
        self._capacity = capacity
        self._blocks: list[dict[str, Tensor]] = []

    def write(self, slots: list[int], patches: CompactPatches) -> None:
        """Puts patch i into slots[i].

        Raises ValueError, and writes nothing, where the patches' shapes are not the earlier ones'.
        """
        source = patches.tensors()
        for name, kept in self._blocks[0].items() if self._blocks else ():
            if kept.shape[1:] != source[name].shape[1:]:
                raise ValueError(
                    f"{name}: shape {list(source[name].shape[1:])} per patch: the store holds "
                    f"patches with {list(kept.shape[1:])}, of another scene or patch size"
                )
        while len(self._blocks) * self.rows <= max(slots, default=-1):
            rows = min(self.rows, self._capacity - len(self._blocks) * self.rows)
            self._blocks.append({n: t.new_zeros(rows, *t.shape[1:]) for n, t in source.items()})
        for index, slot in enumerate(slots):
            block, row = self._blocks[slot // self.rows], slot % self.rows
            for name, tensor in source.items():
                block[name][row] = tensor[index]

    def read(self, slots: list[int]) -> CompactPatches:
        """Copies of the patches in these slots; ValueError where nothing was ever written."""
        if not self._blocks:
            raise ValueError("the store is empty: add patches before reading any")
        if not slots:
            return CompactPatches(**{n: t[:0].clone() for n, t in self._blocks[0].items()})
        rows = [(self._blocks[slot // self.rows], slot % self.rows) for slot in slots]
        return CompactPatches(
            **{name: torch.stack([b[name][row] for b, row in rows]) for name in self._blocks[0]}
        )


def _keep(tensor: Tensor, dtype: torch.dtype, device: torch.device | str = "cpu") -> Tensor:
    return uploaded(tensor.detach().to(dtype), device)
