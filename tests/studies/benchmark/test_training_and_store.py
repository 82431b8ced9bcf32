import pytest
from torch.utils.flop_counter import FlopCounterMode

from ngi.studies.benchmark import training
from ngi.studies.benchmark.store import store


@pytest.mark.parametrize(
    ("learner", "padding"),
    [(training.PAPER, 0.02), (training.OURS, 0.1)],  # ours has columns for the patches, and zeros
)
def test_operations_are_those_that_pytorch_counts(
    learner: training.Learner, padding: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    fused = "ngi.models.image_layers.computed_by_onednn"
    monkeypatch.setattr(fused, lambda _: False)  # PyTorch does not count oneDNN's fused layers
    network = learner.network(
        layout=learner.layout, scene_dimensions=3, hidden_features=64, hidden_layers=4
    )
    patches = training.random_patches(learner.layout, 3, count=2)
    with FlopCounterMode(display=False) as counter:
        network(patches.buffers, patches.scene_vector).sum().backward()
    operations = 2 * 32**2 * training.training_operations(network)
    assert operations == pytest.approx(counter.get_total_flops(), rel=padding)


@pytest.mark.parametrize("learner", [training.PAPER, training.OURS])
def test_a_training_step_is_measured(learner: training.Learner) -> None:
    figures = training.training(16, 3, False, repeats=2, learner=learner)
    assert all(f.median > 0 for f in figures)
    assert all(learner.name in f.name for f in figures)


def test_the_store_is_measured() -> None:
    size, error, draw = store(dimensions=12, count=32, repeats=2)
    assert size.median == pytest.approx(45_145)
    assert 0 < error.median < 0.001
    assert draw.median > 0
