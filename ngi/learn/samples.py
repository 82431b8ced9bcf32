"""Training samples: what is rendered for each, and the inputs that the network gets of it."""

import inspect
from collections.abc import Callable, Container
from functools import partial
from typing import Any, Protocol

import torch
from torch import Tensor, nn

from ngi.denoise import Denoiser, denoised
from ngi.learn.glimpses import glimpsed_buffers
from ngi.learn.supersampling import quarters, with_quarters
from ngi.patches import BufferLayout, Patches
from ngi.render.protocol import Deferred, PatchJob, Renderer
from ngi.render.tracing import of_centres

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
    network_arguments: dict[str, Any]
    """What a network can ask for when it is made, by name, see `network_of`.

    `layout`, `scene_dimensions`: the length of the vector that it is given in v's place, and of
    patches `moving`: what moves, as a function of that vector.
    """
    patch_size: int

    def check_resolution(self, resolution: int) -> None:
        """ValueError where samples cannot be cut from images of so many pixels a side."""
        if resolution < self.patch_size:
            raise ValueError(
                f"resolution: the image has {resolution} pixels a side, less than a "
                f"patch of {self.patch_size}; raise resolution or lower renderer.patch_size"
            )

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> PatchJob:
        """See `ngi.render.Renderer.start_patches`: one sample per state [n, dimensions + 2]."""
        ...

    def blank(self, count: int) -> Patches:
        """`count` black samples, for a rehearsal; patches, where a sample is one."""
        return Patches.blank(
            count, layout=self.layout, dimensions=self.dimensions, patch_size=self.patch_size
        )

    def glimpses(self, states: Tensor, *, resolution: int) -> tuple[Tensor, ...]:  # noqa: ARG002
        """Inputs of the network at few pixels of patches at states [n, dimensions + 2].

        What samplers that look before they choose look at. Raises ValueError where samples are no
        patches.
        """
        raise ValueError(
            f"sampler: it inspects patches before they are traced, but {type(self).__name__} does "
            "not make patches; choose another sampler, for example sampler=uniform"
        )

    def rearranged(self, patches: Patches, generator: torch.Generator) -> Patches:  # noqa: ARG002
        """Stored samples, prepared for being trained on again.

        A sample of several images may choose anew which of them are the network's input.
        """
        return patches

    def example(self, patches: Patches) -> Example:
        """What the network is given of [n] samples, and what it is to answer."""
        ...

    def test_inputs(
        self, scene_vector: Tensor, buffers: Tensor, *, preview: bool = False
    ) -> tuple[Tensor, ...]:
        """What `render` needs beside the buffers [H, W, C] of the image of a v [D].

        preview: of a picture that the next one soon replaces, for which less may do
        What has to be rendered for them belongs to the time that a frame takes.
        """
        ...

    def render(self, network: nn.Module, buffers: Tensor, *inputs: Tensor) -> Tensor:
        """The network's image [H, W, 3], log1p radiance, of buffers and `test_inputs`."""
        return image_of(network, buffers, *inputs)


class PatchSamples(Samples):
    """The paper's `Samples`: one patch each, from whose buffers and v the network tells radiance.

    renderer: of the scene
    camera: whether the network is given the components of v that place the camera, as in the
        paper. The radiance that leaves a point in a direction does not depend on them, and the
        buffers say where the point is and which direction
    denoiser: takes the noise off newly traced radiance, or None
    traced_share: see `ngi.denoise.denoised`
    supersampled_edges: whether the network is asked for each quarter of the pixels that show
        several surfaces, see `ngi.learn.supersampling`; in images alone, not in training
    centred: whether a state's position is that of the patch's centre, see
        `ngi.render.tracing.of_centres`, instead of its corner's, as in the paper

    components: which of v, [0, D), the network is given, in order
    Raises ValueError for a share that is none.
    """

    def __init__(
        self,
        *,
        renderer: Renderer,
        camera: bool = True,
        denoiser: Denoiser | None = None,
        traced_share: float = 0.5,
        supersampled_edges: bool = False,
        centred: bool = False,
    ) -> None:
        if not 0 <= traced_share <= 1:
            raise ValueError(f"data.traced_share is {traced_share}; expected 0 to 1")
        self._renderer = renderer
        self.supersampled_edges = supersampled_edges
        self._centred = centred
        self.layout = renderer.layout
        self._denoise = None
        if denoiser is not None:
            self._denoise = partial(
                denoised, denoiser=denoiser, traced_share=traced_share, layout=self.layout
            )
        self.dimensions = renderer.dimensions
        self.patch_size = renderer.patch_size
        everything = list(range(self.dimensions))
        left_out = slice(0, 0) if camera else renderer.camera_part
        self._seen = slice(0, left_out.start), slice(left_out.stop, self.dimensions)
        self.components = [i for i in everything if i not in everything[left_out]]
        self.network_arguments = {
            "layout": self.layout,
            "scene_dimensions": len(self.components),
            "moving": renderer.moving_points.of(self.components),
        }

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> PatchJob:
        placed = self._placed(states, resolution)
        job = self._renderer.start_patches(placed, resolution=resolution, seed=seed)
        return job if self._denoise is None else Deferred(self._denoise, job)

    def glimpses(self, states: Tensor, *, resolution: int) -> tuple[Tensor, ...]:
        """Buffers [n, h, w, C] of one pixel in 16, and v [n, D], or what is seen of it."""
        placed = self._placed(states, resolution)
        buffers = glimpsed_buffers(placed, self._renderer, resolution=resolution)
        return buffers, self._of(states[:, :-2])

    def example(self, patches: Patches) -> Example:
        """Buffers [n, P, P, C] and v [n, D], or what is seen of it."""
        (buffers, scene_vectors), log_radiance = patch_example(patches)
        return (buffers, self._of(scene_vectors)), log_radiance

    def test_inputs(
        self, scene_vector: Tensor, buffers: Tensor, *, preview: bool = False
    ) -> tuple[Tensor, ...]:
        """What is seen of v, [D] or less, and of a supersampled image `quarters`."""
        seen = self._of(scene_vector)
        if preview or not self.supersampled_edges:
            return (seen,)
        return seen, *quarters(scene_vector, buffers, self._renderer)

    def render(self, network: nn.Module, buffers: Tensor, *inputs: Tensor) -> Tensor:
        seen, *finer = inputs
        image = image_of(network, buffers, seen)
        if not finer:
            return image
        pixels, of_quarters = finer
        return with_quarters(image, pixels, image_of(network, of_quarters, seen))

    def _placed(self, states: Tensor, resolution: int) -> Tensor:
        """As the renderer is given them."""
        if not self._centred:
            return states
        return of_centres(states, patch_size=self.patch_size, resolution=resolution)

    def _of(self, scene_vectors: Tensor) -> Tensor:
        if len(self.components) == self.dimensions:
            return scene_vectors
        # By slices: a GPU would be waited for with a list of indices, which is uploaded.
        return torch.cat([scene_vectors[..., part] for part in self._seen], dim=-1)


def image_of(network: nn.Module, *inputs: Tensor) -> Tensor:
    """What the network itself makes of an image."""
    image: Tensor = network.render(*inputs)  # type: ignore[operator]
    return image


def network_of(samples: Samples, make: Callable[..., nn.Module]) -> nn.Module:
    """A network for these samples.

    make: its class or the like, its own sizes given; what it asks for of
        `Samples.network_arguments` it gets, and all of them where it takes any (`**rest`)
    """
    given = samples.network_arguments
    try:
        parameters = inspect.signature(make).parameters
        takes_any = any(each.kind is each.VAR_KEYWORD for each in parameters.values())
        wanted: Container[str] = given if takes_any else parameters
    except ValueError:  # its own arguments do not fit; the call says which
        wanted = given
    return make(**{name: value for name, value in given.items() if name in wanted})


def patch_example(patches: Patches) -> Example:
    """All that the paper's network is given of patches: buffers [n, P, P, C] and v [n, D]."""
    return (patches.buffers, patches.scene_vector), patches.log_radiance
