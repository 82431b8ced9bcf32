import pytest
import torch
from torch.utils.flop_counter import FlopCounterMode

from ngi.machine.backend import llvm_problem
from ngi.models import PixelGenerator
from ngi.patches import BufferLayout
from ngi.studies.benchmark import inference, scoring
from ngi.studies.benchmark.scenes import shipped

[MIRROR] = shipped(["mirror"])
CHANNELS = 13
"""That the network is fed of it: position, normal, outgoing, albedo, roughness."""


def test_operations_of_a_pixel_are_those_that_pytorch_counts() -> None:
    layout = BufferLayout()
    network = PixelGenerator(layout=layout, scene_dimensions=3, hidden_features=64, hidden_layers=4)
    with FlopCounterMode(display=False) as counter:
        network(torch.rand(1, 16, 16, layout.channels), torch.rand(1, 3))
    expected = 2 * 16**2 * inference.products_per_pixel(network)
    assert expected == pytest.approx(counter.get_total_flops(), rel=0.01)


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
def test_frames_take_as_long_as_buffers_and_network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inference, "RESOLUTIONS", {"cpu": (24,), "cuda": (24,)})
    monkeypatch.setattr(inference, "ROWS", 64)
    figures = inference.inference(MIRROR, repeats=1, seconds=60, features=16, layers=2)
    buffers, *of_networks = (f.median for f in figures)
    names = inference.precisions()
    assert [f.name for f in figures[1::4]] == [f"network 2x16 {p}, 24 × 24" for p in names]
    for i in range(len(names)):
        network, both, share, rate = of_networks[4 * i : 4 * i + 4]
        assert 1 / both == pytest.approx(1 / buffers + 1 / network)
        operations = 2 * 24**2 * (3 * 16 + (16 + CHANNELS) * (16 + 3))
        assert share / 100 == pytest.approx(operations * network / (rate * 1e12))


def test_the_matrix_rate_is_that_of_nothing_but_products() -> None:
    network = PixelGenerator(layout=BufferLayout(), scene_dimensions=3, hidden_features=64)
    with FlopCounterMode(display=False) as counter:
        inference.products(network, torch.float64)()  # which oneDNN leaves to PyTorch
    assert counter.get_total_flops() == 2 * inference.PRODUCTS * inference.ROWS * 64**2


def test_the_picture_is_the_networks_in_the_precision_asked_for() -> None:
    network = PixelGenerator(layout=BufferLayout(), scene_dimensions=3, hidden_features=64)
    buffers, v = torch.rand(8, 8, BufferLayout().channels), torch.rand(3)
    with torch.no_grad():
        exact = network(buffers[None], v[None])[0]
    errors = {
        name: float((inference.show(network, buffers, v, precision=precision) - exact).abs().max())
        for name, precision in {"bf16": torch.bfloat16, "fp32": torch.float32}.items()
    }
    assert errors["fp32"] < 1e-6 < errors["bf16"] < 0.01


def test_scoring_is_what_a_step_with_it_takes_longer_as_a_share_of_generation() -> None:
    figures = scoring.scoring_figures([0.1, 0.2, 0.1], [0.15, 0.25, 0.2], [0.5, 1.0, 0.5])
    share, seconds, batch = (f.median for f in figures)
    assert share == pytest.approx(10)  # of 10, 5 and 20 %
    assert seconds == pytest.approx(50)
    assert batch == pytest.approx(500)
