"""Drawing rules beside the paper's: shuffled epochs, prioritised replay, importance."""

import io

import numpy as np
import pytest
import torch
from scipy import stats

from ngi.explore import Importance
from ngi.patches import BufferLayout
from ngi.reuse import (
    ByImportance,
    Epochs,
    PatchArchive,
    PatchStore,
    Prioritised,
    ProportionalToLoss,
)

LAYOUT = BufferLayout()
LOSSES = [0.0, 0.02, 0.3, 0.3, 1.7, 0.9]
SCHAUL = Prioritised(alpha=0.6, beta=0.4, epsilon=0.01)


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def filled(make_patches, rule, count, capacity=None):
    store = PatchStore(capacity=capacity or count, layout=LAYOUT, rule=rule)
    store.add(make_patches(count))
    return store


def epochs(store, count, generator, *, size, batch):
    """Ids drawn in batches, [count, size]."""
    assert count * size % batch == 0
    drawn = [store.draw(batch, generator) for _ in range(count * size // batch)]
    return torch.cat(drawn).reshape(count, size)


@pytest.mark.parametrize("batch", [8, 7, 24, 40])  # 24 patches: whole, broken and several epochs
def test_every_epoch_draws_each_patch_once_in_an_order_of_its_own(make_patches, batch) -> None:
    store = filled(make_patches, Epochs(), 24)
    found = epochs(store, 35, generator(), size=24, batch=batch)
    assert torch.equal(found.sort(dim=1).values, torch.arange(24).expand(35, 24))
    assert found.unique(dim=0).shape[0] == 35
    again = epochs(filled(make_patches, Epochs(), 24), 35, generator(), size=24, batch=batch)
    assert torch.equal(again, found)
    other = epochs(filled(make_patches, Epochs(), 24), 35, generator(1), size=24, batch=batch)
    assert not torch.equal(other, found)


def test_every_place_of_an_epoch_is_as_likely(make_patches) -> None:
    store = filled(make_patches, Epochs(), 5)
    found = epochs(store, 4000, generator(), size=5, batch=4)
    for place in found.T:
        assert stats.chisquare(torch.bincount(place, minlength=5).numpy()).pvalue > 1e-3


def test_an_epoch_goes_on_after_a_checkpoint(make_patches, tmp_path) -> None:
    store, numbers = filled(make_patches, Epochs(), 24), generator()
    store.draw(16, numbers)
    file = io.BytesIO()
    torch.save(PatchArchive(tmp_path).save(store), file)
    file.seek(0)
    restored = PatchStore(capacity=24, layout=LAYOUT, rule=Epochs())
    PatchArchive(tmp_path).restore(restored, torch.load(file, weights_only=True))
    same = generator()
    same.set_state(numbers.get_state())
    for _ in range(6):
        assert torch.equal(store.draw(5, numbers), restored.draw(5, same))


def test_patches_added_amid_an_epoch_come_with_the_next(make_patches) -> None:
    store, numbers = filled(make_patches, Epochs(), 6, capacity=8), generator()
    begun = store.draw(2, numbers).tolist()
    store.add(make_patches(2, first=6))
    assert sorted([*begun, *store.draw(4, numbers).tolist()]) == [0, 1, 2, 3, 4, 5]
    assert sorted(store.draw(8, numbers).tolist()) == [0, 1, 2, 3, 4, 5, 6, 7]
    begun = store.draw(2, numbers).tolist()
    store.add(make_patches(3, first=8))  # in the place of 0, 1 and 2
    rest = [{0: 8, 1: 9, 2: 10}.get(old, old) for old in range(8) if old not in begun]
    assert sorted(store.draw(6, numbers).tolist()) == sorted(rest)


def drawn_and_weighted(make_patches, rule, losses, count=20_000):
    store = filled(make_patches, rule, len(losses))
    store.update(torch.arange(len(losses)), torch.tensor(losses))
    ids = store.draw(count, generator())
    return torch.bincount(ids, minlength=len(losses)).numpy(), store.loss_weights(ids), ids


@pytest.mark.parametrize("alpha", [0.0, 0.6, 1.0])
def test_draws_follow_the_priorities(make_patches, alpha) -> None:
    rule = Prioritised(alpha=alpha, beta=0.4, epsilon=0.01)
    counts, _, _ = drawn_and_weighted(make_patches, rule, LOSSES)
    priorities = (np.array(LOSSES) + 0.01) ** alpha  # Schaul et al., Eq. 1
    expected = counts.sum() * priorities / priorities.sum()
    assert stats.chisquare(counts, expected).pvalue > 1e-3


@pytest.mark.parametrize("beta", [0.0, 0.4, 1.0])
def test_weights_are_those_of_the_paper(make_patches, beta) -> None:
    rule = Prioritised(alpha=0.6, beta=beta, epsilon=0.01)
    _, weights, ids = drawn_and_weighted(make_patches, rule, LOSSES, count=7)
    priorities = (np.array(LOSSES) + 0.01) ** 0.6
    probabilities = priorities / priorities.sum()
    expected = (1 / len(LOSSES) / probabilities[ids.numpy()]) ** beta  # Sec. 3.4
    assert weights.dtype == torch.float32
    np.testing.assert_allclose(weights.numpy(), expected / expected.max(), rtol=1e-6)


def test_full_correction_makes_the_mean_that_of_uniform_draws(make_patches) -> None:
    rule = Prioritised(alpha=0.6, beta=1.0, epsilon=0.01)
    _, weights, ids = drawn_and_weighted(make_patches, rule, LOSSES)
    values = torch.tensor(LOSSES)[ids]
    assert (weights * values).sum() / weights.sum() == pytest.approx(np.mean(LOSSES), rel=0.03)
    assert values.mean() > 1.5 * np.mean(LOSSES)


def test_by_importance_most_draws_are_uniform_and_none_is_too_frequent(make_patches) -> None:
    """Closed form: 0.9 / m and a tenth in proportion to the losses, 1.2 / m at most."""
    rule = ByImportance(Importance(uniform_share=0.9, largest_ratio=1.2))
    counts, weights, _ = drawn_and_weighted(make_patches, rule, LOSSES)
    losses = np.array(LOSSES)
    expected = 0.9 / 6 + 0.1 * losses / losses.sum()
    assert expected[4] > 1.2 / 6 > expected[5]
    room = 1.2 / 6 - np.minimum(expected, 1.2 / 6)
    expected = np.minimum(expected, 1.2 / 6) + (expected[4] - 1.2 / 6) * room / room.sum()
    assert stats.chisquare(counts, counts.sum() * expected).pvalue > 1e-3
    assert weights is None


def test_weights_of_importance_make_the_mean_that_of_uniform_draws(make_patches) -> None:
    rule = ByImportance(Importance(uniform_share=0.5, weighted=True))
    _, weights, ids = drawn_and_weighted(make_patches, rule, LOSSES)
    values = torch.tensor(LOSSES)[ids]
    assert weights.max() <= 2
    assert (weights * values).mean() == pytest.approx(np.mean(LOSSES), rel=0.02)
    assert values.mean() > 1.3 * np.mean(LOSSES)


def test_the_papers_reuse_is_the_case_of_exponent_1_without_weights(make_patches) -> None:
    losses = [0.1, 0.0, 2.0, 0.4]
    rule = Prioritised(alpha=1.0, beta=0.0, epsilon=1e-300)
    _, weights, ids = drawn_and_weighted(make_patches, rule, losses)
    _, none, same = drawn_and_weighted(make_patches, ProportionalToLoss(), losses)
    assert torch.equal(ids, same)
    assert torch.equal(weights, torch.ones(len(ids)))
    assert none is None


def test_weights_of_patches_count_besides_those_of_the_rule(make_patches) -> None:
    store = PatchStore(
        capacity=3, layout=LAYOUT, rule=Prioritised(alpha=0.6, beta=1.0, epsilon=0.01)
    )
    store.add(make_patches(3), torch.tensor([4.0, 1.0, 2.0]))
    store.update(torch.arange(3), torch.tensor([0.3, 1.7, 0.02]))
    inverse = (np.array([0.02, 0.3, 1.7]) + 0.01) ** -0.6
    found = store.loss_weights(torch.tensor([2, 0, 1]))
    assert found.dtype == torch.float32
    np.testing.assert_allclose(found, [2, 4, 1] * inverse / inverse.max(), rtol=1e-6)


def test_the_weight_of_a_patch_goes_with_it(make_patches) -> None:
    store = PatchStore(capacity=3, layout=LAYOUT)
    store.add(make_patches(3), torch.tensor([4.0, 1.0, 2.0]))
    (new,) = store.add(make_patches(1, first=3))  # in the place of the first
    assert store.loss_weights(torch.tensor([1, new, 2])).tolist() == [1, 1, 2]


@pytest.mark.parametrize("losses", [[0.0] * 5, [1e30] * 5, [3e-324] * 5])
def test_equal_losses_are_drawn_and_weighted_alike(make_patches, losses) -> None:
    counts, weights, _ = drawn_and_weighted(make_patches, SCHAUL, losses)
    assert stats.chisquare(counts).pvalue > 1e-3
    assert (weights == 1).all()


def test_losses_of_all_sizes_have_finite_weights(make_patches) -> None:
    _, weights, ids = drawn_and_weighted(make_patches, SCHAUL, [0.0, 1e-20, 1.0, 1e30], count=10**5)
    assert set(ids.tolist()) <= {2, 3}
    store = filled(make_patches, SCHAUL, 4)
    store.update(torch.arange(4), torch.tensor([0.0, 1e-20, 1.0, 1e30]))
    weights = store.loss_weights(torch.arange(4))
    assert weights.isfinite().all()
    assert weights[0] == 1
    assert (weights > 0).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"alpha": 1.5}, r"rule\.alpha: 1\.5: give a number in \[0, 1\]"),
        ({"beta": -0.1}, r"rule\.beta: -0\.1"),
        ({"beta": float("nan")}, r"rule\.beta: nan"),
        ({"epsilon": 0.0}, r"rule\.epsilon: 0\.0: give a number above 0"),
        ({"epsilon": float("inf")}, r"rule\.epsilon: inf"),
    ],
)
def test_numbers_that_make_no_priorities_are_refused(changes, message) -> None:
    with pytest.raises(ValueError, match=message):
        Prioritised(**{"alpha": 0.6, "beta": 0.4, "epsilon": 1e-6, **changes})


def test_weights_of_patches_that_are_not_stored_are_refused(make_patches) -> None:
    store = filled(make_patches, SCHAUL, 4)
    with pytest.raises(ValueError, match="patch 4 is not in the store"):
        store.loss_weights(torch.tensor([0, 4]))
