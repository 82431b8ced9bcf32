import dataclasses
import json

import numpy as np
import pytest
import torch
from scipy.stats import qmc

from ngi.evaluate import EvaluationProtocol, evaluation_frames
from ngi.render import AnalyticRenderer


def test_identity_changes_with_every_field(protocol: EvaluationProtocol) -> None:
    identities = {protocol.identity}
    for field in dataclasses.fields(protocol):
        value = getattr(protocol, field.name)
        other = value + "2" if isinstance(value, str) else 2 * value + 2 + value % 2
        identities.add(dataclasses.replace(protocol, **{field.name: other}).identity)
    assert len(identities) == len(dataclasses.fields(protocol)) + 1
    assert dataclasses.replace(protocol).identity == protocol.identity


def test_a_number_written_otherwise_is_the_same_protocol(protocol: EvaluationProtocol) -> None:
    """`exposure=1` on the command line, and `1.0`."""
    whole, pointed = (dataclasses.replace(protocol, exposure=one) for one in (1, 1.0))
    assert whole.identity == pointed.identity
    coarse, other = (dataclasses.replace(protocol, epsilon=one) for one in (1, 1.0))
    assert coarse.reference_settings == other.reference_settings
    assert json.dumps(coarse.reference_settings) == json.dumps(other.reference_settings)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("resolution", 31),
        ("low_discrepancy_frames", 0),
        ("samples_per_pass", 0),
        ("maximum_samples", 127),
        ("target_noise", 0.0),
        ("epsilon", -0.01),
        ("epsilon", float("nan")),
        ("epsilon", float("inf")),
        ("exposure", float("nan")),
        ("exposure", float("-inf")),
        ("target_noise", float("inf")),
        ("ssim_window", 10),
        ("ssim_sigma", 0.0),
    ],
)
def test_useless_values_are_refused(protocol: EvaluationProtocol, key: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"'test': {key} is {value}"):
        dataclasses.replace(protocol, **{key: value})


def test_frames_are_the_hard_ones_and_an_even_set(renderer, protocol) -> None:
    protocol = dataclasses.replace(protocol, low_discrepancy_frames=64)
    frames = evaluation_frames(renderer, protocol)
    hard = [frame for frame in frames if frame.set == "hard"]
    uniform = [frame for frame in frames if frame.set == "uniform"]
    assert torch.equal(torch.stack([f.scene_vector for f in hard]), renderer.hard_frames())
    assert [f.index for f in uniform] == list(range(64))
    points = torch.stack([f.scene_vector for f in uniform]).double().numpy()
    random = np.random.default_rng(0).random(points.shape)
    assert qmc.discrepancy(points) < 0.2 * qmc.discrepancy(random)


def test_of_more_variables_than_there_are_sobol_sequences_frames_are_independent(protocol) -> None:
    many = AnalyticRenderer(dimensions=21_202, patch_size=8)
    frames = evaluation_frames(many, dataclasses.replace(protocol, low_discrepancy_frames=4))
    points = torch.stack([frame.scene_vector for frame in frames if frame.set == "uniform"])
    assert points.shape == (4, 21_202)
    assert points.mean(dim=1).sub(0.5).abs().max() < 0.02
    assert points[0].ne(points[1]).all()


def test_frames_depend_on_the_protocols_seed_only(renderer, protocol) -> None:
    def vectors(seed: int) -> torch.Tensor:
        frames = evaluation_frames(renderer, dataclasses.replace(protocol, sobol_seed=seed))
        return torch.stack([frame.scene_vector for frame in frames])

    torch.manual_seed(1)
    first = vectors(3)
    torch.manual_seed(2)
    state = torch.get_rng_state()
    assert torch.equal(first, vectors(3))
    assert torch.equal(state, torch.get_rng_state())
    assert not torch.equal(first, vectors(4))


def test_hard_frames_of_another_scene_are_refused(renderer, protocol) -> None:
    renderer.dimensions = 4
    with pytest.raises(ValueError, match="4 variables"):
        evaluation_frames(renderer, protocol)
