import pytest
from torch.utils.flop_counter import FlopCounterMode

from ngi.benchmark import training
from ngi.benchmark.store import store
from ngi.models import PixelGenerator
from ngi.patches import BufferLayout


def test_operations_are_those_that_pytorch_counts() -> None:
    layout = BufferLayout()
    network = PixelGenerator(layout=layout, scene_dimensions=3, hidden_features=64, hidden_layers=4)
    patches = training.random_patches(layout, 3)
    with FlopCounterMode(display=False) as counter:
        network(patches.buffers, patches.scene_vector).sum().backward()
    ours = training.training_operations(network)
    assert ours == pytest.approx(counter.get_total_flops(), rel=0.02)


def test_a_training_step_is_measured() -> None:
    figures = training.training(16, 3, False, repeats=2)
    assert all(f.median > 0 for f in figures)


def test_the_store_is_measured() -> None:
    size, error, draw = store(dimensions=12, count=32, repeats=2)
    assert size.median == pytest.approx(45_137)
    assert 0 < error.median < 0.001
    assert draw.median > 0
