import math
from dataclasses import replace

import pytest
import torch
from scipy import stats

from ngi.patches import BufferLayout
from ngi.reuse import PatchStore

LAYOUT = BufferLayout()


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def filled(make_patches, losses, capacity=None):
    store = PatchStore(capacity=capacity or len(losses), layout=LAYOUT)
    store.update(store.add(make_patches(len(losses))), torch.tensor(losses))
    return store


def draw_counts(store, n=20_000, seed=0):
    return torch.bincount(store.draw(n, generator(seed)), minlength=store.next_id).numpy()


def test_patches_come_back_by_id(make_patches) -> None:
    store = PatchStore(capacity=300, layout=LAYOUT)
    first, second = make_patches(100), make_patches(150, first=100)
    assert store.add(first).tolist() == list(range(100))
    assert store.add(second).tolist() == list(range(100, 250))
    back = store.get(torch.tensor([120, 3, 120]))
    torch.testing.assert_close(back.log_radiance[1], first.log_radiance[3], atol=4e-3, rtol=0)
    assert torch.equal(back.scene_vector[0], second.scene_vector[20])
    assert torch.equal(back.scene_vector[0], back.scene_vector[2])
    assert len(store) == 250
    assert len(store.get(torch.zeros(0, dtype=torch.int64))) == 0


def test_stored_patches_cannot_be_changed_from_outside(make_patches) -> None:
    store = PatchStore(capacity=4, layout=LAYOUT)
    patches = make_patches(4)
    ids = store.add(patches)
    before = store.get(ids)
    for source in (patches, store.get(ids)):
        for tensor in vars(source).values():
            tensor.zero_()
    for name, tensor in vars(store.get(ids)).items():
        assert torch.equal(tensor, getattr(before, name))


def test_draws_are_proportional_to_the_losses(make_patches) -> None:
    losses = [0.5, 3.0, 0.01, 1.0, 2.0]
    counts = draw_counts(filled(make_patches, losses))
    expected = 20_000 * torch.tensor(losses, dtype=torch.float64) / sum(losses)
    assert stats.chisquare(counts, expected.numpy()).pvalue > 1e-3
    assert stats.chisquare(counts).pvalue < 1e-9


def test_draws_follow_the_last_recorded_loss(make_patches) -> None:
    store = filled(make_patches, [1.0, 1.0, 1.0])
    store.update(torch.tensor([2, 0, 2]), torch.tensor([9.0, 4.0, 2.0]))
    counts = draw_counts(store)
    assert stats.chisquare(counts, [20_000 * w / 7 for w in (4, 1, 2)]).pvalue > 1e-3


def test_losses_of_zero_are_drawn_only_if_there_are_no_others(make_patches) -> None:
    counts = draw_counts(filled(make_patches, [0.0, 1.0, 0.0, 2.0, 0.0]))
    assert counts[[0, 2, 4]].sum() == 0
    assert stats.chisquare(draw_counts(filled(make_patches, [0.0] * 5))).pvalue > 1e-3


def test_non_finite_losses_are_counted_and_never_drawn(make_patches) -> None:
    store = filled(make_patches, [math.nan, 1.0, math.inf, 2.0, -math.inf, -1e-8])
    assert store.non_finite_losses == 3
    assert store.state_dict()["losses"].tolist() == [0, 1, 0, 2, 0, 0]
    assert draw_counts(store)[[0, 2, 4, 5]].sum() == 0
    store.update(torch.tensor([0]), torch.tensor([1e9]))
    assert draw_counts(store)[0] > 19_000


def test_draws_reach_neither_below_the_first_nor_beyond_the_last(make_patches, monkeypatch) -> None:
    store = filled(make_patches, [0.0, 0.1, 0.2, 0.3, 0.7, 0.0])
    for uniform, expected in [(0.0, 1), (1 - 2**-53, 4)]:
        monkeypatch.setattr(
            torch, "rand", lambda n, u=uniform, **_: torch.full((n,), u, dtype=torch.float64)
        )
        assert store.draw(3, generator()).tolist() == [expected] * 3


@pytest.mark.parametrize("loss", [1e-45, 3e-324, 1e-310, 1e-300, 1e30])
def test_tiny_and_huge_losses_are_drawn(make_patches, loss) -> None:
    store = PatchStore(capacity=2, layout=LAYOUT)
    store.update(store.add(make_patches(2)), torch.full((2,), loss, dtype=torch.float64))
    assert stats.chisquare(draw_counts(store)).pvalue > 1e-3


def test_until_recorded_a_loss_is_the_mean_of_the_others(make_patches) -> None:
    store = PatchStore(capacity=8, layout=LAYOUT)
    store.update(store.add(make_patches(2))[:1], torch.tensor([5.0]))
    assert store.mean_loss == 3
    store.add(make_patches(2))
    assert store.state_dict()["losses"].tolist() == [5, 1, 3, 3]


def test_oldest_unpinned_patches_make_room(make_patches) -> None:
    store = PatchStore(capacity=6, layout=LAYOUT)
    store.add(make_patches(6))
    store.pin(torch.tensor([1, -1, 4]))
    assert store.add(make_patches(3, first=6)).tolist() == [6, 7, 8]
    assert store.ids.tolist() == [1, 4, 5, 6, 7, 8]
    store.pin(torch.tensor([8]))
    store.add(make_patches(2, first=9))
    assert store.ids.tolist() == [5, 6, 7, 8, 9, 10]
    numbers = (store.get(store.ids).scene_vector[:, 0] * 2**20).tolist()
    assert numbers == [5, 6, 7, 8, 9, 10]
    assert store.mean_age == pytest.approx((5 + 4 + 3 + 2 + 1 + 0) / 6)


def test_pinned_patches_that_leave_no_room_are_an_error_and_stay(make_patches) -> None:
    store = PatchStore(capacity=6, layout=LAYOUT)
    store.add(make_patches(6))
    store.pin(torch.tensor([0, 1, 2]))
    with pytest.raises(ValueError, match=r"capacity: 6: .* raise it by at least 1"):
        store.add(make_patches(4))
    assert store.ids.tolist() == [0, 1, 2, 3, 4, 5]
    assert store.next_id == 6
    with pytest.raises(ValueError, match="capacity: 6"):
        PatchStore(capacity=6, layout=LAYOUT).add(make_patches(7))


def allocated(store: PatchStore) -> int:
    """Bytes of memory behind all patches."""
    blocks = store._blocks._blocks
    return sum(t.untyped_storage().nbytes() for block in blocks for t in block.values())


@pytest.mark.parametrize("dimensions", [12, 128])
def test_a_patch_takes_at_most_48_kilobytes(make_patches, dimensions) -> None:
    store = PatchStore(capacity=100, layout=LAYOUT)
    for _ in range(7):
        store.add(make_patches(20, size=32, dimensions=dimensions))
    assert len(store) == 100
    assert store.bytes_per_patch <= 48_000
    # Truth: 3 channels of 4 bytes and 16 of 2, v once; id, loss and weight beside it.
    patch = 1024 * (3 * 4 + 16 * 2) + dimensions * 4 + 2 * 4 + 8 + 1
    assert allocated(store) == 100 * patch
    assert store.bytes_per_patch == patch + 3 * 8


def test_memory_grows_with_the_patches_not_with_the_capacity(make_patches) -> None:
    store = PatchStore(capacity=100_000, layout=LAYOUT)
    assert math.isnan(store.bytes_per_patch)
    assert math.isnan(store.mean_age)
    assert math.isnan(store.mean_loss)
    store.add(make_patches(16, size=32))
    assert allocated(store) < 10e6


def test_bad_input_is_named_and_changes_nothing(make_patches) -> None:
    store = PatchStore(capacity=4, layout=LAYOUT)
    with pytest.raises(ValueError, match="empty"):
        store.draw(1, generator())
    with pytest.raises(ValueError, match="capacity: 0"):
        PatchStore(capacity=0, layout=LAYOUT)
    ids = store.add(make_patches(4))
    before = store.state_dict()
    for call in (store.get, store.pin, lambda i: store.update(i, torch.ones(2))):
        with pytest.raises(ValueError, match="patch 4 is not in the store"):
            call(torch.tensor([0, 4]))
    with pytest.raises(ValueError, match="losses: shape"):
        store.update(ids, torch.ones(3))
    with pytest.raises(ValueError, match=r"world_position: shape \[8, 8, 3\]"):
        store.add(make_patches(4, size=8))
    with pytest.raises(ValueError, match=r"scene_vector: shape \[5\]"):
        store.add(make_patches(4, dimensions=5))
    patches = make_patches(4)
    with pytest.raises(ValueError, match="differ in number"):
        store.add(replace(patches, position=patches.position[:3]))
    after = store.state_dict()
    for name in ("ids", "losses", "waiting"):
        assert torch.equal(before.pop(name), after.pop(name))
    assert before == after
    assert (store.get(ids).scene_vector[:, 0] * 2**20).tolist() == [0, 1, 2, 3]


def test_the_hardest_patches_are_those_of_the_highest_losses(make_patches) -> None:
    store = filled(make_patches, [0.3, 0.9, 0.1, 0.5], capacity=5)
    ids, losses = store.hardest(2)
    assert ids.tolist() == [1, 3]
    assert losses.tolist() == pytest.approx([0.9, 0.5])
    store.update(torch.tensor([2]), torch.tensor([7.0]))
    assert store.hardest(1)[0].tolist() == [2]
    assert store.hardest(99)[0].tolist() == [2, 1, 3, 0]
    assert len(PatchStore(capacity=5, layout=LAYOUT).hardest(3)[0]) == 0
