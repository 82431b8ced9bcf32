"""The store against a plain list, under random sequences of calls, checkpoints included."""

import tempfile
from pathlib import Path

import torch
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from ngi.patches import BufferLayout, Patches
from ngi.reuse import PatchArchive, PatchStore

LAYOUT = BufferLayout(("position",))
CAPACITY = 12


def patches(numbers):
    n = len(numbers)
    vector = torch.tensor(numbers, dtype=torch.float32).reshape(n, 1)
    pixels = vector[:, :, None, None].expand(n, 1, 1, 3)
    return Patches(
        scene_vector=vector,
        position=vector.expand(n, 2) / 1000,
        resolution=vector[:, 0].long(),
        large_step=vector[:, 0] % 2 == 0,
        buffers=pixels / 7,
        log_radiance=pixels / 1000,
    )


class StoreModel(RuleBasedStateMachine):
    """`stored` is the truth: [id, loss] of the patches, oldest first."""

    def __init__(self):
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.archive = PatchArchive(Path(self.folder.name))
        self.store = PatchStore(capacity=CAPACITY, layout=LAYOUT)
        self.stored, self.pinned, self.next_id = [], set(), 0

    def teardown(self):
        self.folder.cleanup()

    @rule(n=st.integers(0, 5))
    def add(self, n):
        ids = list(range(self.next_id, self.next_id + n))
        losses = [loss for _, loss in self.stored]
        initial = sum(losses) / len(losses) if losses else 1.0
        room = self.stored + [[i, initial] for i in ids]
        while len(room) > CAPACITY:
            room.remove(next(entry for entry in room if entry[0] not in self.pinned))
        assert self.store.add(patches(ids)).tolist() == ids
        self.stored, self.next_id = room, self.next_id + n

    @precondition(lambda self: self.stored)
    @rule(data=st.data(), loss=st.floats(0, 1e6, width=32))
    def update(self, data, loss):
        entry = data.draw(st.sampled_from(self.stored))
        entry[1] = loss
        self.store.update(torch.tensor([entry[0]]), torch.tensor([loss]))

    @precondition(lambda self: self.stored)
    @rule(data=st.data())
    def pin(self, data):
        ids = [i for i, _ in self.stored]
        chosen = data.draw(st.lists(st.sampled_from([-1, *ids]), max_size=5))
        self.pinned = set(chosen) - {-1}
        self.store.pin(torch.tensor(chosen, dtype=torch.int64))

    @rule()
    def save_and_restore(self):
        state = self.archive.save(self.store)
        self.archive.prune([state])
        draws = self.draws()
        self.archive = PatchArchive(Path(self.folder.name))
        self.store = PatchStore(capacity=CAPACITY, layout=LAYOUT)
        self.archive.restore(self.store, state)
        assert self.draws() == draws

    @rule()
    def save(self):
        self.archive.save(self.store)

    def draws(self):
        if not self.stored:
            return []
        return self.store.draw(8, torch.Generator().manual_seed(0)).tolist()

    @invariant()
    def same_as_the_list(self):
        ids = [i for i, _ in self.stored]
        assert self.store.ids.tolist() == ids
        assert len(self.store) == len(ids) <= CAPACITY
        assert self.store.next_id == self.next_id
        if not ids:
            return
        expected, got = patches(ids), self.store.get(torch.tensor(ids))
        assert torch.equal(got.scene_vector, expected.scene_vector)
        assert torch.equal(got.resolution, expected.resolution)
        assert torch.equal(got.buffers, expected.buffers)
        assert torch.equal(got.log_radiance, expected.log_radiance.half().float())
        state = self.store.state_dict()
        losses = dict(zip(state["ids"].tolist(), state["losses"].tolist(), strict=True))
        for patch_id, loss in self.stored:
            assert abs(losses[patch_id] - loss) <= 1e-9 * (1 + loss)
        assert set(self.draws()) <= set(ids)


TestStoreModel = StoreModel.TestCase
TestStoreModel.settings = settings(
    max_examples=30, stateful_step_count=25, deadline=None, derandomize=True
)
