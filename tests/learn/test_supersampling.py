import pytest
import torch
from torch import Tensor, nn

from ngi.learn import PatchSamples
from ngi.learn.supersampling import LEAST, SIZES, edges, quarters, with_quarters
from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer

LAYOUT = BufferLayout()
V = torch.tensor([0.3, 0.8, 0.1])
SIDE = 64


def ramp(name: str, difference: float, *, at: int | None = None) -> Tensor:
    """[8, 8, C]: constant but for one component of a buffer, which rises evenly, or at a column."""
    buffers = torch.full((8, 8, LAYOUT.channels), 0.25)
    column = torch.arange(8.0)
    rises = difference * (column if at is None else (column >= at).float())
    buffers[..., LAYOUT.slice(name).start + 1] = rises
    return buffers


@pytest.mark.parametrize("name", [name for name in LEAST if name in LAYOUT.names])
def test_both_sides_of_a_step_are_an_edge(name: str) -> None:
    """Which of them shows a part of the other surface, the buffers do not tell."""
    found = edges(ramp(name, 1.01 * LEAST[name], at=3), LAYOUT)
    assert found.nonzero().tolist() == [[row, column] for row in range(8) for column in (2, 3)]
    assert not edges(ramp(name, 0.99 * LEAST[name], at=3), LAYOUT).any()


def test_what_changes_slowly_is_no_edge() -> None:
    assert not edges(ramp("normal", 0.49 * LEAST["normal"]), LAYOUT).any()
    assert edges(ramp("normal", 0.51 * LEAST["normal"]), LAYOUT)[:, 1:-1].all()


def test_a_scene_without_normals_has_edges_of_what_it_has() -> None:
    layout = BufferLayout(("position",))
    step = torch.zeros(4, 4, 3)
    step[2:] = 1.0
    assert edges(step, layout).nonzero()[:, 0].unique().tolist() == [1, 2]


def renderer() -> AnalyticRenderer:
    """Whose lamp has an edge."""
    return AnalyticRenderer(dimensions=3, patch_size=16)


def test_quarters_are_those_pixels_of_an_image_of_twice_as_many_a_side() -> None:
    buffers = renderer().image_buffers(V, resolution=SIDE)
    pixels, found = quarters(V, buffers, renderer())
    fine = renderer().image_buffers(V, resolution=2 * SIDE)
    blocks = fine.unfold(0, 2, 2).unfold(1, 2, 2).flatten(0, 1)  # [n, C, 2, 2]
    assert torch.equal(found, blocks[pixels].permute(2, 3, 0, 1).flatten(0, 1))
    marked = edges(buffers, LAYOUT).flatten().nonzero().flatten()
    assert 0 < len(marked) < SIDE**2 / 4
    assert torch.equal(pixels[: len(marked)], marked)
    assert set(pixels[len(marked) :].tolist()) <= {int(marked[-1])}
    assert len(pixels) % (SIDE**2 // SIZES) == 0


def test_where_there_is_no_edge_nothing_is_rendered() -> None:
    assert quarters(V, torch.zeros(8, 8, LAYOUT.channels), renderer()) == ()


def test_quarters_count_as_radiance() -> None:
    image = torch.zeros(2, 2, 3)
    answers = torch.tensor([1.0, 2.0, 3.0, 6.0])[:, None, None].expand(4, 1, 3).log1p()
    shown = with_quarters(image, torch.tensor([2]), answers).expm1()
    torch.testing.assert_close(shown[1, 0], torch.full((3,), 3.0))
    assert not shown[0].any()
    assert not shown[1, 1].any()


class Squares(nn.Module):
    """Far from linear in the buffers, as networks are."""

    def render(self, buffers: Tensor, v: Tensor) -> Tensor:
        return (buffers[..., LAYOUT.slice("emission")] * 3 - v[0]).square()


def test_only_edges_are_asked_for_in_quarters_and_previews_not_at_all() -> None:
    samples = PatchSamples(renderer=renderer(), supersampled_edges=True)
    buffers = renderer().image_buffers(V, resolution=SIDE)
    network = Squares()
    once = network.render(buffers, V)
    shown = samples.render(network, buffers, *samples.test_inputs(V, buffers))
    fine = network.render(renderer().image_buffers(V, resolution=2 * SIDE), V).expm1()
    means = fine.unfold(0, 2, 2).unfold(1, 2, 2).mean((-1, -2)).log1p()
    at_edges = edges(buffers, LAYOUT)[..., None]
    torch.testing.assert_close(shown, torch.where(at_edges, means, once))
    assert (shown - once).abs().max() > 0.1
    preview = samples.test_inputs(V, buffers, preview=True)
    assert torch.equal(samples.render(network, buffers, *preview), once)


def test_without_it_an_image_is_what_the_network_says() -> None:
    samples = PatchSamples(renderer=renderer())
    buffers = renderer().image_buffers(V, resolution=SIDE)
    (seen,) = samples.test_inputs(V, buffers)
    assert torch.equal(samples.render(Squares(), buffers, seen), Squares().render(buffers, V))
