"""The stream alone: a made-up training step answers each batch."""

from pathlib import Path

import pytest
import torch

from ngi.explore import GrowingResolution
from ngi.reuse import Never, UntilFull
from tests.learn.small_stream import CHAINS, constant_resolution, make, steps


def test_first_batches_are_new_and_later_ones_are_not_all(tmp_path: Path) -> None:
    generated = [batch.generated for batch in steps(make(tmp_path), 40)]
    assert all(generated[:3])
    assert 5 < sum(generated[3:]) < 32


def test_a_reused_batch_holds_the_stored_patches(tmp_path: Path) -> None:
    stream = make(tmp_path, capacity=1000)
    seen = {}
    for batch in steps(stream, 40):
        for i, patch_id in enumerate(batch.ids.tolist()):
            if batch.generated:
                seen[patch_id] = batch.patches[i : i + 1]
            else:
                assert torch.equal(batch.patches.scene_vector[i], seen[patch_id].scene_vector[0])
                torch.testing.assert_close(
                    batch.patches.log_radiance[i], seen[patch_id].log_radiance[0], atol=2e-3, rtol=0
                )


def test_greedy_chains_climb(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=Never())
    current = [
        batch.current.log_radiance.mean(dim=(1, 2, 3))
        for batch in steps(stream, 60)
        if batch.current is not None
    ]
    targets = torch.stack(current)
    assert (targets[1:] >= targets[:-1]).all()
    assert targets[-1].mean() > targets[0].mean() + 0.05


def test_uniform_sampling_scores_nothing(tmp_path: Path) -> None:
    for batch in steps(make(tmp_path, greedy=False, policy=Never()), 10):
        assert batch.current is None


def test_the_current_states_survive_a_store_that_is_too_small_for_the_rest(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=Never(), capacity=2 * CHAINS)
    assert sum(batch.current is not None for batch in steps(stream, 50)) == 49


def test_a_full_store_is_a_fixed_data_set(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=UntilFull(), capacity=8 * CHAINS)
    generated = [batch.generated for batch in steps(stream, 20)]
    assert generated == [True] * 8 + [False] * 12


def test_the_resolution_grows_with_the_steps(tmp_path: Path) -> None:
    schedule = GrowingResolution(start=16, step=4, every=3, end=24)
    stream = make(tmp_path, policy=Never(), schedule=schedule)
    resolutions = [int(batch.patches.resolution[0]) for batch in steps(stream, 12)]
    assert resolutions == [16] * 3 + [20] * 3 + [24] * 6


def test_same_seed_same_batches_other_seed_others(tmp_path: Path) -> None:
    first, same, other = (make(tmp_path / str(i), seed=s) for i, s in enumerate((0, 0, 1)))
    for a, b, c in zip(steps(first, 15), steps(same, 15), steps(other, 15), strict=True):
        assert torch.equal(a.patches.log_radiance, b.patches.log_radiance)
        assert torch.equal(a.ids, b.ids)
        assert not torch.equal(a.patches.scene_vector, c.patches.scene_vector)


def test_a_restored_stream_goes_on_bit_for_bit(tmp_path: Path) -> None:
    unbroken = make(tmp_path / "a")
    for _ in steps(unbroken, 20):
        pass
    state = unbroken.state_dict()
    restored = make(tmp_path / "a", seed=99)
    restored.load_state_dict(state)
    for a, b in zip(steps(unbroken, 20), steps(restored, 20), strict=True):
        assert a.generated == b.generated
        assert torch.equal(a.ids, b.ids)
        assert torch.equal(a.patches.buffers, b.patches.buffers)
    assert unbroken.log_row() == restored.log_row()


def test_a_batch_without_feedback_stops_the_stream(tmp_path: Path) -> None:
    batches = iter(make(tmp_path))
    next(batches)
    with pytest.raises(RuntimeError, match="feedback"):
        next(batches)


def test_a_patch_larger_than_the_image_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"7 pixels a side.*patch of 8"):
        make(tmp_path, schedule=constant_resolution(7))


def test_a_store_without_room_for_chains_and_batch_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"reuse\.store\.capacity: 7 .* at least 8"):
        make(tmp_path, capacity=7)


def test_log_columns_do_not_change(tmp_path: Path) -> None:
    stream = make(tmp_path)
    first = stream.log_row().keys()
    for _ in steps(stream, 10):
        pass
    assert stream.log_row().keys() == first


def test_an_unknown_word_for_late_patches_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"reuse\.when_late: 'skip'.*\['wait', 'reuse'\]"):
        make(tmp_path, when_late="skip")
