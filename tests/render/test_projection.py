"""Where the camera shows a point, against the positions that its own rays hit."""

from pathlib import Path

import pytest
import torch

from ngi.machine.backend import llvm_problem
from ngi.render import AnalyticRenderer
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import SceneDescription, read_scene, scenes
from tests.render.optics import write_scene
from tests.render.test_direct_light import BULB, FLOOR, PAINT

SIZE = 16


@pytest.mark.parametrize("scene", ["living-room", "mirror"])  # a camera that v moves, one at rest
def test_what_a_pixel_sees_is_projected_into_its_middle(scene: str) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    assert_projected(read_scene(**scenes()[scene]))


LOOK = "{object: camera, property: look_at, minimum: [-1, -1, 3.5, -0.1, -0.1, 0], \
maximum: [1, 1, 4.5, 0.1, 0.1, 0]}"
SHIFT = '<float name="principal_point_offset_x" value="0.1"/>\
<float name="principal_point_offset_y" value="-0.05"/>'


@pytest.mark.parametrize("variable", [PAINT, LOOK])
def test_of_a_camera_that_is_shifted_and_mirrored(tmp_path: Path, variable: str) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    write_scene(tmp_path, shapes=FLOOR + BULB, variables=[variable], fov=40)
    file = tmp_path / "scene.xml"
    words = file.read_text().replace("<lookat", '<scale x="-1"/><lookat')
    file.write_text(words.replace('<float name="fov"', SHIFT + '<float name="fov"'))
    renderer = assert_projected(read_scene(tmp_path))
    straight = torch.full((renderer.dimensions,), 0.5)
    position = renderer.image_buffers(straight, resolution=SIZE)[8]
    x = position[:, renderer.layout.slice("position").start]
    assert (x.diff() < 0).all(), "what is to the right lies at the left of the picture"


def assert_projected(scene: SceneDescription) -> MitsubaRenderer:
    renderer = MitsubaRenderer(scene=scene, backend="llvm", buffer_samples=1)
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
    return renderer


def test_closed_formulas_show_the_unit_square() -> None:
    renderer = AnalyticRenderer(dimensions=3, patch_size=8)
    matrices = renderer.projections(torch.rand(5, 3))
    assert torch.equal(matrices, torch.eye(4).repeat(5, 1, 1))
