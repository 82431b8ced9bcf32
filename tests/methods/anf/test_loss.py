"""The loss of sequences, against their formula."""

import pytest
import torch

from ngi.methods.anf import SequenceSmape
from ngi.methods.anf.loss import EPSILON, smape


def frames(seed: int) -> torch.Tensor:
    return torch.rand(2, 3, 4, 5, 3, generator=torch.Generator().manual_seed(seed))


def test_it_is_what_its_formula_says() -> None:
    a, b = frames(0), frames(1)
    expected = [
        sum(
            (p - q).abs().sum().item() / (p.abs().sum().item() + q.abs().sum().item() + EPSILON)
            for p, q in zip(x.reshape(-1, 3), y.reshape(-1, 3), strict=True)
        )
        / (3 * 3 * 4 * 5)
        for x, y in zip(a, b, strict=True)
    ]
    torch.testing.assert_close(smape(a, b), torch.tensor(expected))


def test_changes_count_by_their_weight() -> None:
    a, b = frames(0), frames(1)
    plain, both = (SequenceSmape(temporal_weight=w)(a.log1p(), b.log1p()) for w in (0.0, 0.25))
    torch.testing.assert_close(plain, smape(a, b))
    torch.testing.assert_close(both, smape(a, b) + 0.25 * smape(a.diff(dim=1), b.diff(dim=1)))
    assert torch.equal(SequenceSmape(temporal_weight=1.0)(a, a), torch.zeros(2))


def test_wrong_input_is_named() -> None:
    with pytest.raises(ValueError, match="temporal_weight is -1"):
        SequenceSmape(temporal_weight=-1)
    with pytest.raises(ValueError, match="two frames at least"):
        SequenceSmape(temporal_weight=0.25)(frames(0)[:, :1], frames(1)[:, :1])
