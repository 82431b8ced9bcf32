import errno
import os
import re
from functools import partial
from pathlib import Path

import pytest
import torch

from ngi.files.durable import DamagedError
from ngi.patches import BufferLayout
from ngi.reuse import PatchArchive, PatchStore
from ngi.reuse import archive as archive_module

LAYOUT = BufferLayout()
FULL_DEVICE = Path("/dev/full")


def new_store(capacity=32):
    return PatchStore(capacity=capacity, layout=LAYOUT)


def segments(folder):
    return sorted(path.name for path in folder.iterdir())


def through_a_checkpoint(state, folder):
    """As the caller's checkpoint would hold it."""
    path = folder / "checkpoint"
    torch.save(state, path)
    state = torch.load(path, weights_only=True)
    path.unlink()
    return state


def assert_same(store, other):
    assert torch.equal(store.ids, other.ids)
    if len(store):
        expected = store.get_compact(store.ids).tensors()
        for name, tensor in other.get_compact(store.ids).tensors().items():
            assert tensor.dtype == expected[name].dtype
            assert torch.equal(tensor, expected[name])
    state, others = store.state_dict(), other.state_dict()
    for name in ("ids", "losses", "waiting"):
        assert torch.equal(state.pop(name), others.pop(name))
    assert state == others


def work(store, make_patches, batches, *, first):
    """Some steps of a run; the same arguments do the same."""
    generator = torch.Generator().manual_seed(first)
    for batch in range(batches):
        ids = store.add(make_patches(8, first=first + batch))
        store.update(ids, torch.rand(8, generator=generator))
        store.pin(ids[:2])
        drawn = store.draw(8, generator)
        store.update(drawn, torch.rand(8, generator=generator))


def test_a_restored_store_is_the_same_and_goes_on_the_same(make_patches, tmp_path) -> None:
    store, archive = new_store(), PatchArchive(tmp_path)
    for first in (0, 10, 20):
        work(store, make_patches, 3, first=first)
        state = archive.save(store)
    state = through_a_checkpoint(state, tmp_path)
    restored, again = new_store(), PatchArchive(tmp_path)
    again.restore(restored, state)
    assert_same(store, restored)
    for one in (store, restored):
        work(one, make_patches, 5, first=30)
    assert_same(store, restored)
    assert archive.save(store)["segments"] == again.save(restored)["segments"]


def test_only_new_patches_are_written(make_patches, tmp_path) -> None:
    store, archive = new_store(), PatchArchive(tmp_path)
    assert archive.save(store)["segments"] == []
    assert not list(tmp_path.iterdir())
    work(store, make_patches, 2, first=0)
    archive.save(store)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    work(store, make_patches, 1, first=2)
    archive.save(store)
    archive.save(store)
    assert segments(tmp_path) == [
        "patches-000000000000-000000000016.pt",
        "patches-000000000016-000000000024.pt",
    ]
    assert all((tmp_path / name).read_bytes() == content for name, content in before.items())
    written = torch.load(tmp_path / segments(tmp_path)[1], weights_only=True)
    assert written["ids"].tolist() == list(range(16, 24))
    assert written["log_radiance"].dtype == torch.float16


def test_many_new_patches_are_written_in_several_segments(
    make_patches, tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(archive_module, "SEGMENT_IDS", 10)
    store, archive = new_store(), PatchArchive(tmp_path)
    work(store, make_patches, 6, first=0)
    state = archive.save(store)
    # Of the ids 0 … 47, the 32 youngest and none of the first segment are stored.
    assert [(s["first"], s["last"]) for s in state["segments"]] == [
        (10, 20),
        (20, 30),
        (30, 40),
        (40, 48),
    ]
    restored = new_store()
    PatchArchive(tmp_path).restore(restored, state)
    assert_same(store, restored)


def test_a_run_killed_before_its_checkpoint_writes_the_segment_again(
    make_patches, tmp_path
) -> None:
    store, archive = new_store(), PatchArchive(tmp_path)
    work(store, make_patches, 2, first=0)
    checkpoint = through_a_checkpoint(archive.save(store), tmp_path)
    work(store, make_patches, 3, first=2)
    lost = archive.save(store)  # killed here: no checkpoint holds this, nothing is pruned
    before = (tmp_path / lost["segments"][-1]["name"]).read_bytes()

    store, archive = new_store(), PatchArchive(tmp_path)
    archive.restore(store, checkpoint)
    work(store, make_patches, 3, first=2)
    assert archive.save(store)["segments"] == lost["segments"]
    assert (tmp_path / lost["segments"][-1]["name"]).read_bytes() == before


def test_prune_removes_what_no_checkpoint_needs(make_patches, tmp_path) -> None:
    store, archive = new_store(capacity=24), PatchArchive(tmp_path)
    states = []
    for batch in range(6):
        work(store, make_patches, 1, first=batch)
        states.append(archive.save(store))
    (tmp_path / "patches-000000000048-000000000056.pt.partial").touch()
    (tmp_path / "last.ckpt").touch()
    assert len(segments(tmp_path)) == 8
    # 24 of the 48 patches are stored now, and 24 of the first 40 were one checkpoint earlier.
    needed = {f"patches-{first:012d}-{first + 8:012d}.pt" for first in (16, 24, 32, 40)}
    removed = archive.prune(states[-2:])
    assert set(segments(tmp_path)) == needed | {"last.ckpt"}
    assert "patches-000000000048-000000000056.pt.partial" in removed
    for state in states[-2:]:
        restored = new_store(capacity=24)
        PatchArchive(tmp_path).restore(restored, state)
    assert_same(store, restored)
    assert archive.prune(states[-2:]) == []


def test_a_pinned_patch_keeps_its_segment(make_patches, tmp_path) -> None:
    store, archive = new_store(capacity=24), PatchArchive(tmp_path)
    store.add(make_patches(8))
    store.pin(torch.tensor([3]))
    for batch in range(5):
        archive.save(store)
        store.add(make_patches(8, first=100 + batch))
    state = archive.save(store)
    archive.prune([state])
    restored = new_store(capacity=24)
    PatchArchive(tmp_path).restore(restored, state)
    assert_same(store, restored)
    assert 3 in restored.ids


@pytest.mark.parametrize("call", ["write", "fsync", "replace"])
def test_a_full_disk_leaves_the_earlier_state(make_patches, tmp_path, monkeypatch, call) -> None:
    store, archive = new_store(), PatchArchive(tmp_path)
    work(store, make_patches, 2, first=0)
    state = archive.save(store)
    before = segments(tmp_path)
    work(store, make_patches, 1, first=2)
    path = tmp_path / "patches-000000000016-000000000024.pt"

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        if call != "write":
            patch.setattr(os, call, full)
        elif FULL_DEVICE.exists():
            path.with_name(path.name + ".partial").symlink_to(FULL_DEVICE)
        else:
            pytest.skip(f"no {FULL_DEVICE} here")
        with pytest.raises(OSError, match="earlier checkpoints are intact") as caught:
            archive.save(store)
    assert caught.value.errno == errno.ENOSPC
    assert caught.value.filename == str(path)
    assert segments(tmp_path) == before
    PatchArchive(tmp_path).restore(new_store(), state)

    later = archive.save(store)  # there is room again
    restored = new_store()
    PatchArchive(tmp_path).restore(restored, later)
    assert_same(store, restored)


def saved(make_patches, folder):
    store, archive = new_store(), PatchArchive(folder)
    for first in (0, 2):
        work(store, make_patches, 2, first=first)
        state = archive.save(store)
    return state, folder / state["segments"][-1]["name"]


def assert_refused(state, folder, path, message):
    store = new_store()
    for read in (PatchArchive(folder).check, partial(PatchArchive(folder).restore, store)):
        with pytest.raises(DamagedError, match=re.escape(str(path)) + ".*" + message):
            read(state)
    assert len(store) == 0


def test_a_missing_segment_is_named(make_patches, tmp_path) -> None:
    state, path = saved(make_patches, tmp_path)
    path.unlink()
    assert_refused(state, tmp_path, path, "gone")


@pytest.mark.parametrize("keep", [0, 10, 1000])
def test_a_cut_segment_is_named(make_patches, tmp_path, keep) -> None:
    state, path = saved(make_patches, tmp_path)
    path.write_bytes(path.read_bytes()[:keep])
    assert_refused(state, tmp_path, path, "not a readable file")


def test_a_flipped_bit_is_found(make_patches, tmp_path) -> None:
    state, path = saved(make_patches, tmp_path)
    content = torch.load(path, weights_only=True)
    stored = content["log_radiance"].numpy().tobytes()
    raw = bytearray(path.read_bytes())
    raw[raw.find(stored[:64]) + 5] ^= 1
    path.write_bytes(raw)
    assert_refused(state, tmp_path, path, "not the patches")


def test_a_segment_is_on_disk_before_it_has_its_name(make_patches, tmp_path, monkeypatch) -> None:
    calls = []
    for name in ("fsync", "replace"):
        original = getattr(os, name)
        monkeypatch.setattr(
            os, name, lambda *args, n=name, f=original: (calls.append(n), f(*args))[1]
        )
    store = new_store()
    work(store, make_patches, 1, first=0)
    PatchArchive(tmp_path).save(store)
    assert calls == ["fsync", "replace", "fsync"]


def test_other_ids_or_fields_are_found(make_patches, tmp_path) -> None:
    state, path = saved(make_patches, tmp_path)
    content = torch.load(path, weights_only=True)
    torch.save({**content, "ids": content["ids"] + 1}, path)
    assert_refused(state, tmp_path, path, "not the patches")
    torch.save({"ids": content["ids"]}, path)
    assert_refused(state, tmp_path, path, "not a readable file")
    torch.save([1], path)
    assert_refused(state, tmp_path, path, "not a readable file")


def test_a_state_that_names_too_few_segments_is_refused(make_patches, tmp_path) -> None:
    state, _ = saved(make_patches, tmp_path)
    with pytest.raises(ValueError, match=r"patches \[16, 17"):
        PatchArchive(tmp_path).restore(new_store(), {**state, "segments": state["segments"][:1]})


def test_another_scene_or_a_smaller_store_is_refused(make_patches, tmp_path) -> None:
    state, _ = saved(make_patches, tmp_path)
    other = PatchStore(capacity=32, layout=BufferLayout(("position", "normal")))
    with pytest.raises(ValueError, match="another scene"):
        PatchArchive(tmp_path).restore(other, state)
    with pytest.raises(ValueError, match="at least 32"):
        PatchArchive(tmp_path).restore(new_store(capacity=31), state)
