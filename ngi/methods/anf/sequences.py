"""Training samples of a denoiser: sequences of noisy frames along paths through the scene."""

from dataclasses import replace
from functools import partial

import torch
from torch import Tensor

from ngi.learn.samples import Example, Samples
from ngi.patches import Patches
from ngi.render.protocol import Deferred, PatchJob, RenderedPatches, Renderer
from ngi.render.tracing import check_states, derive_seed, patch_window

TEST_SEED = 0
"""Of the noise of test frames, and of the way that leads to them."""


class Sequences(Samples):
    """The samples of Işık et al. 2021: patches of a few frames, in which v moves along a line.

    Every frame is rendered with the renderer's samples per pixel, and `target_renderings` times
    more with other random numbers, whose mean is what the denoiser is to give. A state is v of the
    first frame, then the direction of the path, (1/2, 1/2, ...) for none; v stays within [0, 1].
    Where a pixel was a frame before is told by its position and that frame's camera: a surface that
    moves is looked for where it is now. (The paper has frames of random paths, and the motion of
    surfaces too.)

    The frames that lead to a test frame are rendered at its resolution, and count as its input.

    renderer: of the scene. frames: of a sequence, at least 2. target_renderings: at least 1
    reach: most that a component of v changes from the first frame to the last, in (0, 1]
    """

    def __init__(
        self, *, renderer: Renderer, frames: int, target_renderings: int, reach: float
    ) -> None:
        if frames < 2 or target_renderings < 1 or not 0 < reach <= 1:
            raise ValueError(
                f"data.frames is {frames}, data.target_renderings {target_renderings}, data.reach "
                f"{reach:g}: expected at least 2, at least 1, and above 0 up to 1"
            )
        self._renderer = renderer
        self._frames = frames
        self._target_renderings = target_renderings
        self._reach = reach
        self.layout = renderer.layout
        self.dimensions = 2 * renderer.dimensions
        self.network_arguments = {"layout": self.layout, "scene_dimensions": self.dimensions}
        self.patch_size = renderer.patch_size

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> PatchJob:
        """Of n sequences, buffers [n, frames, P, P, C] and radiance [n, 2, frames, P, P, 3].

        The radiance is first as it is given, then as it is to become.
        """
        check_states(states, self.dimensions)
        position = states[:, None, -2:].expand(-1, self._frames, -1)
        placed = torch.cat([self.path(states[:, :-2]), position], dim=-1).flatten(0, 1)
        jobs = [
            self._renderer.start_patches(
                placed, resolution=resolution, seed=derive_seed(seed, rendering)
            )
            for rendering in range(1 + self._target_renderings)
        ]
        return Deferred(partial(_sequences, frames=self._frames), *jobs)

    def blank(self, count: int) -> Patches:
        patches = super().blank(count)
        axes = (1, self._frames, 1, 1, 1)
        return replace(
            patches,
            buffers=patches.buffers[:, None].repeat(*axes),
            log_radiance=patches.log_radiance[:, None, None].repeat(1, 2, *axes[1:]),
        )

    def example(self, patches: Patches) -> Example:
        """The arguments of `ngi.methods.anf.AffinityDenoiser.forward`."""
        corners = [
            patch_window(position, patch_size=self.patch_size, resolution=int(resolution))
            for position, resolution in zip(patches.position, patches.resolution, strict=True)
        ]
        noisy, target = patches.log_radiance.unbind(dim=1)
        sources = self._sources(
            patches.buffers,
            self.path(patches.scene_vector.cpu()),
            corner=torch.tensor([(window.x, window.y) for window in corners]),
            resolution=patches.resolution.cpu(),
        )
        return (patches.buffers, noisy, sources), target

    def test_inputs(
        self,
        scene_vector: Tensor,
        buffers: Tensor,
        *,
        preview: bool = False,  # noqa: ARG002
    ) -> tuple[Tensor, ...]:
        """The arguments of `ngi.methods.anf.AffinityDenoiser.render`."""
        resolution = len(buffers)
        generator = torch.Generator().manual_seed(TEST_SEED)
        back = torch.rand(len(scene_vector), generator=generator)
        path = self.path(torch.cat([scene_vector, back])[None]).flip(1)[0]
        noisy = [
            torch.log1p(_finite(self._noisy_frame(v, resolution, seed=derive_seed(TEST_SEED, t))))
            for t, v in enumerate(path)
        ]
        before = [self._renderer.image_buffers(v, resolution=resolution).cpu() for v in path[:-1]]
        of_path = torch.stack([*before, buffers.cpu()])
        sources = self._sources(
            of_path[None],
            path[None],
            corner=torch.zeros(1, 2, dtype=torch.int64),
            resolution=torch.tensor([resolution]),
        )
        return torch.stack(noisy), of_path[:-1], sources[0]

    def path(self, states: Tensor) -> Tensor:
        """States without patch position [n, dimensions] to v of every frame [n, frames, D]."""
        v, direction = states.chunk(2, dim=1)
        time = torch.linspace(0, 1, self._frames)[None, :, None]
        return (v[:, None] + self._reach * time * (2 * direction[:, None] - 1)).clamp(0, 1)

    def _noisy_frame(self, v: Tensor, resolution: int, *, seed: int) -> Tensor:
        return self._renderer.render_image(
            v,
            resolution=resolution,
            samples_per_pixel=self._renderer.samples_per_pixel,
            seed=seed,
        ).cpu()

    def _sources(
        self, buffers: Tensor, path: Tensor, *, corner: Tensor, resolution: Tensor
    ) -> Tensor:
        """[n, frames - 1, H, W] int64: see `ngi.methods.anf.AffinityDenoiser.forward`.

        buffers: [n, frames, H, W, C]; path: [n, frames, D]; corner: [n, 2], first column and row of
            the patch in its image; resolution: [n], of the image
        """
        points = buffers[:, 1:, ..., self.layout.slice("position")]
        height, width = points.shape[2:4]
        matrices = self._renderer.projections(path[:, :-1].flatten(0, 1))
        matrices = matrices.view(*points.shape[:2], 1, 4, 4).to(points)
        with torch.autocast(points.device.type, enabled=False):  # bfloat16 tells 256 pixels apart
            film = torch.einsum("nfpij,nfpj->nfpi", matrices, _homogeneous(points.flatten(2, 3)))
        scale, corner = resolution.to(points)[:, None, None, None], corner.to(points)
        w = film[..., 3:]
        pixel = (scale * film[..., :2] / w - corner[:, None, None]).floor()
        size = torch.tensor([width, height]).to(points)
        inside = ((pixel >= 0) & (pixel < size)).all(dim=-1) & (w[..., 0] > 0)  # NaN is outside
        index = pixel[..., 1] * width + pixel[..., 0]
        sources: Tensor = index.where(inside, -1).long().unflatten(2, (height, width))
        return sources


def _homogeneous(points: Tensor) -> Tensor:
    return torch.nn.functional.pad(points, (0, 1), value=1.0)


def _finite(radiance: Tensor) -> Tensor:
    return radiance.where(radiance.isfinite().all(dim=-1, keepdim=True), 0)


def _sequences(noisy: RenderedPatches, *others: RenderedPatches, frames: int) -> RenderedPatches:
    """Of renderings of all frames."""
    mean = torch.stack([torch.expm1(other.log_radiance) for other in others]).mean(dim=0)
    pair = torch.stack([noisy.log_radiance, torch.log1p(mean)])
    return RenderedPatches(
        buffers=noisy.buffers.unflatten(0, (-1, frames)),
        log_radiance=pair.unflatten(1, (-1, frames)).transpose(0, 1).contiguous(),
        repaired=sum(rendered.repaired for rendered in (noisy, *others)),
        masked=sum(rendered.masked for rendered in (noisy, *others)),
        paths=sum(rendered.paths for rendered in (noisy, *others)),
    )
