"""Training samples of CNSR: images of one scene configuration, seen by several cameras."""

from dataclasses import replace

import torch
from torch import Tensor

from ngi.explore.space_filling import SobolSequence
from ngi.learn.samples import Example, Samples
from ngi.patches import Patches
from ngi.render.protocol import Deferred, PatchJob, RenderedPatches, Renderer
from ngi.render.tracing import check_states

TEST_SEED = 0
"""Of the observations of test frames: noise, and where they are taken from."""


class ObservationSets(Samples):
    """The samples of Granskog et al. 2020: a query image, and observations of the same scene.

    All of them are whole images of P x P pixels, with as many samples per pixel; the paper has 3
    observations, P = 64 and 16 sets in a batch (Sec. 7.2.2). A state is v, whose camera is the
    query's, then each observation's components of v for the camera. As in their program any image
    of a stored set may be the query when it is trained on again.

    A test frame is observed from cameras spread over their range, the same for all frames. Where no
    variable places the camera, all images of a set show the same view, with noise of their own.

    renderer: of the scene. observations: how many, at least 1.
    """

    def __init__(self, *, renderer: Renderer, observations: int) -> None:
        if observations < 1:
            raise ValueError(f"data.observations is {observations}; expected at least 1")
        self._renderer = renderer
        self._part = renderer.camera_part
        self._shape = torch.Size([observations, self._part.stop - self._part.start])
        self.layout = renderer.layout
        self.dimensions = renderer.dimensions + self._shape.numel()
        self.network_arguments = {"layout": self.layout, "scene_dimensions": self.dimensions}
        self.patch_size = renderer.patch_size

    def check_resolution(self, resolution: int) -> None:
        if resolution != self.patch_size:
            raise ValueError(
                f"resolution: images of {resolution} pixels a side, but data=observation_sets "
                f"trains on whole images of renderer.patch_size = {self.patch_size}; choose "
                f"resolution=constant resolution.start={self.patch_size}, or another patch_size"
            )

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> PatchJob:
        """Of n sets, [n, 1 + observations, P, P, ...], query first."""
        check_states(states, self.dimensions)
        views = self._views(states[:, :-2])
        job = self._renderer.start_patches(
            _placed(views, states[:, -2:]).flatten(0, 1), resolution=resolution, seed=seed
        )

        def sets(rendered: RenderedPatches) -> RenderedPatches:
            buffers, log_radiance = (
                images.unflatten(0, (-1, views.shape[1]))
                for images in (rendered.buffers, rendered.log_radiance)
            )
            return replace(rendered, buffers=buffers, log_radiance=log_radiance, first_half=None)

        return Deferred(sets, job)

    def blank(self, count: int) -> Patches:
        patches = super().blank(count)
        images = 1 + self._shape[0]
        return replace(
            patches,
            buffers=patches.buffers[:, None].repeat(1, images, 1, 1, 1),
            log_radiance=patches.log_radiance[:, None].repeat(1, images, 1, 1, 1),
        )

    def rearranged(self, patches: Patches, generator: torch.Generator) -> Patches:
        """The images of all sets in one random order."""
        order = torch.randperm(1 + self._shape[0], generator=generator)
        views = self._views(patches.scene_vector)[:, order]
        return replace(
            patches,
            scene_vector=torch.cat([views[:, 0], views[:, 1:, self._part].flatten(1)], dim=1),
            buffers=patches.buffers[:, order],
            log_radiance=patches.log_radiance[:, order],
        )

    def example(self, patches: Patches) -> Example:
        """The arguments of `ngi.methods.cnsr.CNSR.forward`."""
        views = self._views(patches.scene_vector).cpu()
        cameras = self._renderer.cameras(views.flatten(0, 1)).unflatten(0, views.shape[:2])
        cameras = cameras.to(patches.buffers)
        images = torch.cat([patches.buffers, patches.log_radiance], dim=-1)
        query = patches.buffers[:, 0], cameras[:, 0]
        return (*query, images[:, 1:], cameras[:, 1:]), patches.log_radiance[:, 0]

    def test_inputs(
        self,
        scene_vector: Tensor,
        buffers: Tensor,  # noqa: ARG002
        *,
        preview: bool = False,  # noqa: ARG002
    ) -> tuple[Tensor, ...]:
        """The observations keep the resolution of training."""
        observations, components = self._shape
        points = SobolSequence(seed=TEST_SEED).points(0, observations, max(components, 1))
        taken_from = points[:, :components].flatten()
        views = self._views(torch.cat([scene_vector, taken_from])[None])
        states = _placed(views, torch.full((1, 2), 0.5))[0, 1:]
        rendered = self._renderer.render_patches(states, resolution=self.patch_size, seed=TEST_SEED)
        images = torch.cat([rendered.buffers, rendered.log_radiance], dim=-1)
        cameras = self._renderer.cameras(views[0]).to(images)
        return cameras[0], images, cameras[1:]

    def _views(self, states: Tensor) -> Tensor:
        """States without patch position [n, dimensions] to v of every image [n, images, D]."""
        v, cameras = states.split([self._renderer.dimensions, self._shape.numel()], dim=1)
        views: Tensor = v[:, None].repeat(1, 1 + self._shape[0], 1)
        views[:, 1:, self._part] = cameras.reshape(len(states), *self._shape)
        return views


def _placed(views: Tensor, position: Tensor) -> Tensor:
    """[n, images, D] and patch positions [n, 2] to the renderer's states [n, images, D + 2].

    The position of a whole image decides nothing but its random numbers: one for each.
    """
    images = views.shape[1]
    index = torch.arange(images)[None, :, None]
    return torch.cat([views, (index + position[:, None]) / images], dim=-1)
