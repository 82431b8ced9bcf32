"""Where a renderer says its camera stands, against the rays that its buffers were made with."""

import re
import shutil
from pathlib import Path

import pytest
import torch

from ngi.render import AnalyticRenderer
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene

LIGHT = "{object: lamp, property: intensity, minimum: 0.5, maximum: 2}"
LOOK_AT = (
    "{object: camera, property: look_at, "
    "minimum: [-0.5, 0.8, 2, -0.2, 1, 0.3], maximum: [0.5, 1.4, 3, 0.2, 1, 0.3]}"
)
MOVED = "{object: camera, property: translation, minimum: [0, 0, 0], maximum: [0.1, 0.2, 0.3]}"
PATH = "{object: camera, property: camera_path, keys: [[0, 1, 4, 0, 1, 0], [1, 1.5, 3, 0, 1, 0]]}"


def renderer(box: Path, folder: Path, *variables: str, dimensions: int) -> MitsubaRenderer:
    shutil.copytree(box, folder)
    text = (folder / "scene.yaml").read_text()
    frames = f"hard_frames:\n  - {[0.5] * dimensions}\n"
    entries = "".join(f"  - {entry}\n" for entry in variables)
    head = re.split(r"^variables:", text, flags=re.MULTILINE)[0]
    (folder / "scene.yaml").write_text(f"{head}variables:\n{entries}{frames}")
    return MitsubaRenderer(scene=read_scene(folder), backend="scalar", patch_size=8)


@pytest.mark.parametrize(
    ("view", "part"), [(LOOK_AT, slice(1, 5)), (PATH, slice(1, 2))], ids=["look_at", "camera_path"]
)
def test_cameras_are_those_of_the_rays(
    box_folder: Path, tmp_path: Path, view: str, part: slice
) -> None:
    made = renderer(box_folder, tmp_path / "box", LIGHT, view, dimensions=part.stop)
    assert made.camera_part == part
    low, high = torch.tensor([[-1.0, 0, -1], [1, 2, 1]])
    vectors = torch.rand(3, part.stop, generator=torch.Generator().manual_seed(0))
    for v, camera in zip(vectors, made.cameras(vectors), strict=True):
        origin, direction = low + camera[:3] * (high - low), camera[3:]
        buffers = made.image_buffers(v, resolution=17)
        hit = buffers[..., made.layout.slice("normal")].sum(-1) > 0
        point = low + buffers[..., made.layout.slice("position")] * (high - low)
        outgoing = buffers[..., made.layout.slice("outgoing")]
        towards = torch.nn.functional.normalize(origin - point, dim=-1)
        assert hit.sum() > 40
        # Both buffers are means over a pixel's rays: they agree up to its size, but at edges.
        error = (towards - torch.nn.functional.normalize(outgoing, dim=-1)).norm(dim=-1)
        assert error[hit].median() < 1e-3
        middle = torch.nn.functional.normalize(-outgoing[7:10, 7:10].mean(dim=(0, 1)), dim=-1)
        torch.testing.assert_close(middle, direction, rtol=0, atol=5e-3)


@pytest.mark.parametrize(("view", "dimensions"), [((), 3), ((LOOK_AT,), 7)])
def test_where_a_camera_is_that_is_moved_otherwise_is_not_said_wrongly(
    box_folder: Path, tmp_path: Path, view: tuple[str, ...], dimensions: int
) -> None:
    made = renderer(box_folder, tmp_path / "box", *view, MOVED, dimensions=dimensions)
    vectors = torch.rand(2, made.dimensions)
    for asked in (made.cameras, made.projections):
        with pytest.raises(ValueError, match="variables other than look_at and camera_path move"):
            asked(vectors)


def test_a_camera_that_v_does_not_place_tells_nothing(box_folder: Path, tmp_path: Path) -> None:
    still = renderer(box_folder, tmp_path / "box", LIGHT, dimensions=1)
    for made, count in ((still, 1), (AnalyticRenderer(dimensions=3, patch_size=8), 3)):
        assert made.camera_part == slice(0, 0)
        assert torch.equal(made.cameras(torch.rand(2, count)), torch.zeros(2, 6))
