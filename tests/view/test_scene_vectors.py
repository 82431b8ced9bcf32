"""Paths of v: through their key frames, smooth, inside the hypercube."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from ngi.view.scene_vectors import along, key_frames

OPEN = torch.tensor([[0.0, 1.0, 0.2], [0.5, 0.0, 0.2], [1.0, 0.0, 0.3], [0.2, 0.9, 1.0]])
CLOSED = torch.cat([OPEN, OPEN[:1]])


def test_an_open_path_meets_every_key_frame() -> None:
    path = along(OPEN, 31)
    torch.testing.assert_close(path[::10], OPEN)
    assert along(OPEN, 4).allclose(OPEN)


def test_a_closed_path_gives_its_first_v_once() -> None:
    path = along(CLOSED, 40)
    torch.testing.assert_close(path[::10], OPEN)
    assert not path[-1].allclose(path[0])


def test_a_closed_path_is_smooth_at_its_seam() -> None:
    """Begun at another key frame, it is the same."""
    elsewhere = torch.cat([OPEN[2:], OPEN[:2], OPEN[2:3]])
    torch.testing.assert_close(along(elsewhere, 400), along(CLOSED, 400).roll(-200, dims=0))


@pytest.mark.parametrize("keys", [OPEN, CLOSED])
def test_paths_are_smooth_and_stay_between_their_key_frames(keys: torch.Tensor) -> None:
    count = 3000
    path = along(keys, count).double()
    assert path.min() >= 0
    assert path.max() <= 1
    assert (path[:, 2] >= 0.2 - 1e-6).all()
    steps = path.diff(dim=0) * count / (len(keys) - 1)
    assert steps.abs().max() < 3  # a monotone cubic is at most three times as steep as its chord
    assert steps.diff(dim=0).abs().max() < 0.05  # no kinks


def test_a_single_key_frame_stands_still() -> None:
    assert torch.equal(along(OPEN[1:2], 3), OPEN[[1, 1, 1]])


def test_what_the_viewer_saves_is_a_path_of_one_v(tmp_path: Path) -> None:
    file = tmp_path / "v.json"
    file.write_text('{"v": [0.25, 0.5, 1.0]}')
    run: Any = SimpleNamespace(renderer=SimpleNamespace(dimensions=3), description=None)
    assert key_frames(str(file), run, still=0).tolist() == [[0.25, 0.5, 1.0]]
    for content, message in (('{"v": [2]}', r"v.json\[0\]: \[2\]"), ("{}", "no list of v")):
        file.write_text(content)
        with pytest.raises(ValueError, match=message):
            key_frames(str(file), run, still=0)
