"""The sampler that knows where the rare is."""

from pathlib import Path

import pytest
import torch

from ngi.render import PocketRenderer
from ngi.studies.exploration_map.known_pockets import KnownPockets
from ngi.studies.exploration_map.plan import OUR_LEARNER, Plan
from ngi.studies.exploration_map.setting import Method, Setting
from ngi.studies.exploration_map.training import train

VOLUME, SHARE, COUNT = 0.02, 0.25, 20_000


def drawn(*, weighted: bool, pockets: int = 1):
    renderer = PocketRenderer(
        dimensions=5, active=2, volume=VOLUME, pockets=pockets, sharpness=1.0, patch_size=8
    )
    proposal = KnownPockets(renderer=renderer, share=SHARE, weighted=weighted)
    generator = torch.Generator().manual_seed(0)
    return renderer, proposal.propose(torch.zeros(COUNT, 7), generator, batch=0)


@pytest.mark.parametrize("pockets", [1, 3])
def test_a_share_is_in_the_pockets_and_weighs_less(pockets: int) -> None:
    renderer, proposals = drawn(weighted=True, pockets=pockets)
    lit = renderer.weights(proposals.position[:, :-2]).sum(dim=1) > 0  # sharp borders: the boxes
    expected = SHARE + (1 - SHARE) * VOLUME
    assert lit.double().mean().item() == pytest.approx(expected, abs=0.01)
    weights = proposals.weight
    assert weights is not None
    assert torch.allclose(weights[~lit], torch.tensor(1 / (1 - SHARE)))
    assert weights[lit].mean().item() == pytest.approx(1 / (1 - SHARE + SHARE / VOLUME), rel=0.01)
    assert weights.mean().item() == pytest.approx(1, abs=0.02)
    weighted = (weights * lit).mean().item()
    assert weighted == pytest.approx(VOLUME, rel=0.05), "as under uniform states"


def test_unweighted_states_are_the_same() -> None:
    _, weighted = drawn(weighted=True)
    _, plain = drawn(weighted=False)
    assert torch.equal(weighted.position, plain.position)
    assert plain.weight is None


def test_runs_have_more_of_the_rare_and_count_it_less() -> None:
    plan = Plan(settings=(), steps=40, evaluations=1, frames=20, learner=OUR_LEARNER)
    setting = Setting(dimensions=2, active=2, hidden_features=8)
    uniform, known, weighted = (
        list(train(setting, Method(sampler, reuse=False), 0, plan, folder=Path()))[-1]
        for sampler in ("uniform", "known", "known_weighted")
    )
    assert known["lit"] > 3 * uniform["lit"]
    assert known["lit"] == weighted["lit"]
    assert known["error_tail"] != weighted["error_tail"]
