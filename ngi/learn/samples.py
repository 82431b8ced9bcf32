"""What one training sample is, and what of it the network is given."""

from __future__ import annotations

from typing import Protocol

import torch
from torch import Tensor

from ngi.patches import BufferLayout, Patches
from ngi.render.protocol import PatchJob, Renderer

Example = tuple[tuple[Tensor, ...], Tensor]
"""The network's inputs, its arguments in order, and the log1p radiance that it is to give."""


class Samples(Protocol):
    """The training samples of a scene, made with its renderer.

    The sampler draws their states, the store keeps them as `Patches`, whose buffers and radiance
    may have further axes before the pixels', as where one sample is several images.
    """

    layout: BufferLayout
    """Of the buffers."""
    dimensions: int
    """Of a sample's state, which stands where v does; the patch position is not counted."""
    patch_size: int

    def check_resolution(self, resolution: int) -> None:
        """ValueError where samples cannot be cut from images of so many pixels a side."""
        ...

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> PatchJob:
        """See `ngi.render.Renderer.start_patches`: one sample per state [n, dimensions + 2]."""
        ...

    def blank(self, count: int) -> Patches:
        """`count` black samples, for a rehearsal."""
        ...

    def rearranged(self, patches: Patches, generator: torch.Generator) -> Patches:
        """Stored samples as they are trained on again: what of a sample is what may change."""
        ...

    def example(self, patches: Patches) -> Example:
        """What the network is given of [n] samples, and what it is to answer."""
        ...

    def test_inputs(self, scene_vector: Tensor, *, resolution: int) -> tuple[Tensor, ...]:
        """The network's inputs beside the buffers for an image of a v [D], without the axis n.

        What has to be rendered for them belongs to the time that a frame takes.
        """
        ...


class PatchSamples:
    """The paper's `Samples`: one patch each, from whose buffers and v the network tells radiance.

    renderer: of the scene
    """

    def __init__(self, *, renderer: Renderer) -> None:
        self.layout = renderer.layout
        self.dimensions = renderer.dimensions
        self.patch_size = renderer.patch_size
        self.start_patches = renderer.start_patches

    def check_resolution(self, resolution: int) -> None:
        """See `Samples.check_resolution`."""
        if resolution < self.patch_size:
            raise ValueError(
                f"resolution: the image has {resolution} pixels a side, less than a "
                f"patch of {self.patch_size}; raise resolution or lower renderer.patch_size"
            )

    def blank(self, count: int) -> Patches:
        """See `Samples.blank`."""
        return Patches.blank(
            count, layout=self.layout, dimensions=self.dimensions, patch_size=self.patch_size
        )

    def rearranged(self, patches: Patches, generator: torch.Generator) -> Patches:  # noqa: ARG002
        """See `Samples.rearranged`: a patch is what it is."""
        return patches

    @staticmethod
    def example(patches: Patches) -> Example:
        """See `Samples.example`: buffers [n, P, P, C] and v [n, D]."""
        return (patches.buffers, patches.scene_vector), patches.log_radiance

    @staticmethod
    def test_inputs(scene_vector: Tensor, *, resolution: int) -> tuple[Tensor, ...]:  # noqa: ARG004
        """See `Samples.test_inputs`: v itself."""
        return (scene_vector,)
