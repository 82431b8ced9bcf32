"""What every renderer of variable scenes offers; Mitsuba's and the analytic one implement it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from torch import Tensor

from ngi.patches import BufferLayout, MovingPoints


@dataclass(frozen=True)
class RenderedPatches:
    """buffers: [n, P, P, C] float32; log_radiance: [n, P, P, 3] float32, log1p of linear RGB.

    repaired: number of patches that held NaN or Inf and were rendered again with another seed.
    masked: number of patches that still held such pixels, which were then set to zero.
    paths: number of camera paths traced for the radiance.
    first_half: as log_radiance, by the first half of each pixel's samples alone; None where nobody
        asked for it. How far it is from log_radiance tells the noise of that (`ngi.learn.noise`).
    """

    buffers: Tensor
    log_radiance: Tensor
    repaired: int
    masked: int
    paths: int
    first_half: Tensor | None = None


class PatchJob(Protocol):
    """Patches that are being rendered, or will be when they are asked for."""

    def done(self) -> bool:
        """Whether `result` has nobody else to wait for."""
        ...

    def result(self) -> RenderedPatches:
        """The patches, waited for; the same object every time.

        Raises what `Renderer.render_patches` raises.
        """
        ...


class Deferred:
    """The `PatchJob` whose patches this process makes when they are asked for.

    others: jobs of what they are made of; `make` is given their results, in order
    """

    def __init__(self, make: Callable[..., RenderedPatches], *others: PatchJob) -> None:
        self._make = make
        self._others = others

    def done(self) -> bool:
        return all(job.done() for job in self._others)

    def result(self) -> RenderedPatches:
        return self._result

    @cached_property
    def _result(self) -> RenderedPatches:
        return self._make(*(job.result() for job in self._others))


class Renderer(Protocol):
    """Renders a variable scene: scene vector, patch and resolution in, buffers and radiance out."""

    layout: BufferLayout
    dimensions: int
    """D, the number of scene variables."""
    patch_size: int
    """P, pixels along a patch's side."""
    samples_per_pixel: int
    """spp of training patches."""
    halves: bool = False
    """Whether patches have `RenderedPatches.first_half`."""
    buffer_samples: int
    """Rays per pixel of the buffers."""
    moving_points: MovingPoints
    """Where the things are that variables move along."""
    camera_part: slice
    """The components of v that place the camera; empty where none does."""
    scene_hash: str
    """Content hash of the scene's files; part of a run's identity and of a reference's name."""
    description: str
    """One line for logs and result files: backend, variant, LLVM or GPU."""

    def warm_up(self) -> None:
        """Compiles what patches need, so that no run pays for it and the next one does not."""
        return

    def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        """Traces one patch per state; only its own pixels.

        states: [n, D + 2] in [0, 1]: the scene vector, then the patch position (x, y). The patch's
        first pixel column is floor(x * (resolution - P + 1)), clamped to the last one; rows alike.
        The same states, resolution and seed give the same numbers bit for bit on the same machine,
        but where a GPU's memory was too small at one time and not at another: see
        `ngi.render.fitting`.
        Raises ValueError for states of the wrong length or outside [0, 1], or a patch larger than
        the image.
        """
        ...

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> PatchJob:
        """`render_patches` that may go on beside whatever the caller does next.

        By itself it begins when the patches are asked for.
        """
        return Deferred(lambda: self.render_patches(states, resolution=resolution, seed=seed))

    def render_image(
        self, scene_vector: Tensor, *, resolution: int, samples_per_pixel: int, seed: int
    ) -> Tensor:
        """[H, W, 3] float32, linear RGB: radiance of resolution x resolution pixels for a v [D].

        Pixels that a path made NaN or Inf stay so, unlike those of a patch: a mean over several
        images must leave them out, and a zero in their place would darken it.
        """
        ...

    def image_buffers(
        self, scene_vector: Tensor, *, resolution: int, samples: int | None = None
    ) -> Tensor:
        """[H, W, C] float32: the first-hit buffers of the same pixels, as `layout` names them.

        samples: rays per pixel, or more where that many do not reach all emitters;
            `buffer_samples` where None
        On the device that renders, so that a network on the same GPU need not wait for copies.
        Without noise, so there is no seed. A pixel with NaN or Inf is zero in all channels.
        """
        ...

    def pixel_buffers(
        self,
        scene_vector: Tensor,
        pixels: Tensor,
        *,
        resolution: int,
        samples: int | None = None,
        caustics: bool = True,
    ) -> Tensor:
        """[n, C] float32: what `image_buffers` has at n pixels, without making the others.

        pixels: [n] int64 on the CPU, of the image's, counted from 0 row by row; n >= 1
        samples: as of `image_buffers`
        caustics: False leaves their light out, whose photons take most of the time of few pixels
        """
        ...

    def cameras(self, scene_vectors: Tensor) -> Tensor:
        """[n, 6] float32, for v [n, D]: where the camera stands and where it looks to.

        Its origin, normalised as positions are, and its unit direction in world space; zeros where
        no component of v places it. Raises ValueError where the renderer cannot tell.
        """
        ...

    def projections(self, scene_vectors: Tensor) -> Tensor:
        """[n, 4, 4] float32, for v [n, D]: where in the image a point is.

        (x, y, ., w) = matrix (position, 1), for positions normalised as in the buffers: x / w and
        y / w from 0 to 1 across and down the image, w > 0 in front of the camera. Raises ValueError
        where the renderer cannot tell.
        """
        ...

    def hard_frames(self) -> Tensor:
        """[10, D]: the scene's hard test frames (paper, Sec. 7.2.1)."""
        ...

    def close(self) -> None:
        """Ends whatever works for the renderer elsewhere; it is not used any more."""
        return
