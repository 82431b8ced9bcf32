import pytest
import torch
from torch.utils.flop_counter import FlopCounterMode

from ngi.backend import llvm_problem
from ngi.benchmark import inference, scoring
from ngi.benchmark.scenes import shipped
from ngi.models import PixelGenerator
from ngi.patches import BufferLayout

[MIRROR] = shipped(["mirror"])


def test_operations_of_a_pixel_are_those_that_pytorch_counts() -> None:
    layout = BufferLayout()
    network = PixelGenerator(layout=layout, scene_dimensions=3, hidden_features=64, hidden_layers=4)
    with FlopCounterMode(display=False) as counter:
        network.render(torch.rand(16, 16, layout.channels), torch.rand(3))
    expected = 2 * 16**2 * inference.products_per_pixel(network)
    assert expected == pytest.approx(counter.get_total_flops(), rel=0.01)


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
def test_frames_take_as_long_as_buffers_and_network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inference, "RESOLUTIONS", {"cpu": (24,), "cuda": (24,)})
    monkeypatch.setattr(inference, "CHUNK", 64)
    figures = inference.inference(MIRROR, repeats=1, features=16, layers=2)
    buffers, network, frames, share = (f.median for f in figures)
    assert frames == pytest.approx(1000 / (buffers + network))
    assert share > 0


def test_scoring_is_what_a_step_with_it_takes_longer_as_a_share_of_generation() -> None:
    figures = scoring.scoring_figures([0.1, 0.2, 0.1], [0.15, 0.25, 0.2], [0.5, 1.0, 0.5])
    share, seconds, batch = (f.median for f in figures)
    assert share == pytest.approx(10)  # of 10, 5 and 20 %
    assert seconds == pytest.approx(50)
    assert batch == pytest.approx(500)
