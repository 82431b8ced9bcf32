"""Where the camera shows a point, against the positions that its own rays hit."""

import pytest
import torch

from ngi.machine.backend import llvm_problem
from ngi.render import AnalyticRenderer
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene, scenes

SIZE = 16


@pytest.mark.parametrize("scene", ["living-room", "mirror"])  # a camera that v moves, one at rest
def test_what_a_pixel_sees_is_projected_into_its_middle(scene: str) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    renderer = MitsubaRenderer(
        scene=read_scene(**scenes()[scene]), backend="llvm", buffer_samples=1
    )
    vectors = torch.rand(2, renderer.dimensions, generator=torch.Generator().manual_seed(0))
    y, x = torch.meshgrid(*[(torch.arange(SIZE) + 0.5) / SIZE] * 2, indexing="ij")
    for v, matrix in zip(vectors, renderer.projections(vectors), strict=True):
        buffers = renderer.image_buffers(v, resolution=SIZE)
        position = buffers[..., renderer.layout.slice("position")]
        hit = (position != 0).any(dim=-1)
        film = torch.nn.functional.pad(position, (0, 1), value=1.0) @ matrix.T
        assert hit.sum() > 100
        assert (film[hit][:, 3] > 0).all()
        found = film[hit][:, :2] / film[hit][:, 3:]
        torch.testing.assert_close(found, torch.stack([x, y], -1)[hit], atol=2e-4, rtol=0)


def test_closed_formulas_show_the_unit_square() -> None:
    renderer = AnalyticRenderer(dimensions=3, patch_size=8)
    matrices = renderer.projections(torch.rand(5, 3))
    assert torch.equal(matrices, torch.eye(4).repeat(5, 1, 1))
