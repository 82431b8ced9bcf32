"""The store of rendered patches to train on again (paper, Sec. 6.1)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import torch
from torch import Tensor

from ngi.patches import BufferLayout, Patches
from ngi.reuse.compact import CompactPatches, PatchBlocks
from ngi.reuse.drawing import DrawingRule, ProportionalToLoss
from ngi.reuse.place import place_for


class PatchStore:
    """Keeps up to `capacity` patches and draws some of them to be trained on again.

    capacity: number of patches (release: 100,000); when it is reached the oldest patches that are
        not pinned make room
    layout: the buffers of the scene's patches
    rule: which patches are drawn; None for the paper's, in proportion to their last losses
    device: where they are trained on: a GPU keeps them itself where all of them fit (`place_for`)

    Patches are known by their ids, which count up from 0 and are never used again; a stored patch
    never changes. See `CompactPatches` for the precision, and for what is always on the CPU.
    A checkpoint of it is made by `PatchArchive`.
    """

    def __init__(
        self,
        *,
        capacity: int,
        layout: BufferLayout,
        rule: DrawingRule | None = None,
        device: str = "cpu",
    ) -> None:
        if capacity < 1:
            raise ValueError(f"capacity: {capacity}: give at least 1, in patches")
        self.capacity = capacity
        self.layout = layout
        self._rule = rule or ProportionalToLoss()
        self._device = torch.device(device)
        self._place: torch.device | None = None  # of the patches, from the first one on
        self._waiting = torch.zeros(0, dtype=torch.int64)  # slots, as the rule left them
        self._blocks = PatchBlocks(capacity=capacity)
        self._slots: dict[int, int] = {}  # id -> slot, oldest id first; slots 0 … len - 1 are full
        self._ids = torch.zeros(capacity, dtype=torch.int64)  # by slot
        self._losses = torch.zeros(capacity, dtype=torch.float64)  # by slot, finite and >= 0
        self._weights = torch.ones(capacity, dtype=torch.float64)  # by slot
        self._weighted = False
        self._pinned: frozenset[int] = frozenset()
        self._next_id = 0
        self._non_finite_losses = 0

    def __len__(self) -> int:
        return len(self._slots)

    @property
    def ids(self) -> Tensor:
        """[len] int64, ids of the stored patches, oldest first."""
        return torch.tensor(list(self._slots), dtype=torch.int64)

    @property
    def next_id(self) -> int:
        """Id of the next patch to be added; as many were added in all."""
        return self._next_id

    @property
    def draws_by_loss(self) -> bool:
        """Whether it depends on the recorded losses which patches are drawn, or how they count."""
        return self._rule.by_loss

    @property
    def bytes_per_patch(self) -> float:
        """Bytes that one patch more takes, as measured; NaN for an empty store.

        The Python dictionary of ids is not in.
        """
        if not self._slots:
            return float("nan")
        one = self._blocks.read([0]).tensors().values()
        bookkeeping = (self._ids, self._losses, self._weights)
        return sum(tensor.untyped_storage().nbytes() for tensor in one) + sum(
            tensor.element_size() for tensor in bookkeeping
        )

    @property
    def mean_age(self) -> float:
        """Mean number of patches added after a stored patch; NaN for an empty store."""
        return (self._next_id - 1 - self._ids[: len(self)].double()).mean().item()

    @property
    def mean_loss(self) -> float:
        """Mean of the losses last recorded of the patches; NaN for an empty store."""
        return self._losses[: len(self)].mean().item()

    @property
    def non_finite_losses(self) -> int:
        """How many NaN or infinite losses were recorded, as 0, so far."""
        return self._non_finite_losses

    def log_row(self) -> dict[str, float | int | None]:
        """What is logged with every step."""
        return {
            "store_size": len(self),
            "store_mean_age": self.mean_age,
            "store_mean_loss": self.mean_loss,
            "non_finite_losses": self.non_finite_losses,
        }

    def add(self, patches: Patches, weights: Tensor | None = None) -> Tensor:
        """Stores n patches and returns their ids, [n] int64, consecutive.

        weights: [n], factors of their losses whenever they are trained on; None for 1

        Until their losses are recorded they have the stored patches' mean loss, the first ones 1.
        Raises ValueError, and stores nothing, for patches of another scene or size, for numbers
        half precision cannot hold, and where pinned patches leave no room for n more.
        """
        compact = self._placed(
            CompactPatches.compress(patches, self.layout, device=self._place or "cpu")
        )
        initial_loss = self.mean_loss if self._slots else 1.0
        victims = self._oldest_unpinned(len(self) + len(compact) - self.capacity)
        free = range(len(self), min(len(self) + len(compact), self.capacity))
        slots = [*free, *(self._slots[victim] for victim in victims)]
        self._blocks.write(slots, compact)

        for victim in victims:
            del self._slots[victim]
        ids = list(range(self._next_id, self._next_id + len(compact)))
        self._slots.update(zip(ids, slots, strict=True))
        self._ids[slots] = torch.tensor(ids, dtype=torch.int64)
        self._losses[slots] = initial_loss
        self._weights[slots] = 1.0 if weights is None else weights.double()
        self._weighted |= weights is not None
        self._next_id += len(compact)
        return torch.tensor(ids, dtype=torch.int64)

    def get(self, ids: Tensor) -> Patches:
        """Copies of the patches of n ids, [n]. Raises ValueError for ids that are not stored."""
        return self.get_compact(ids).expand()

    def get_compact(self, ids: Tensor) -> CompactPatches:
        """As `get`, in the precision they are stored in."""
        return self._blocks.read(self._slots_of(ids))

    def draw(self, count: int, generator: torch.Generator) -> Tensor:
        """Draws ids, [count] int64, as `rule` says. `generator` is on the CPU.

        Raises ValueError for an empty store.
        """
        if not self._slots:
            raise ValueError("the store is empty: generate patches before drawing any")
        losses = self._losses[: len(self)]
        slots, self._waiting = self._rule.draw(losses, self._waiting, count, generator)
        return self._ids[slots]

    def loss_weights(self, ids: Tensor) -> Tensor | None:
        """[n] float32, the factors of n just drawn patches' losses in a batch's mean; None for 1.

        Raises ValueError for ids that are not stored.
        """
        slots = torch.tensor(self._slots_of(ids), dtype=torch.int64)
        weights = self._rule.weights(self._losses[: len(self)], slots)
        if self._weighted:
            weights = self._weights[slots] * (1.0 if weights is None else weights)
        return None if weights is None else weights.float()

    def hardest(self, count: int) -> tuple[Tensor, Tensor]:
        """Ids and losses of the patches of the highest recorded losses, at most `count` each."""
        losses, slots = self._losses[: len(self)].topk(min(count, len(self)))
        return self._ids[slots], losses

    def update(self, ids: Tensor, losses: Tensor) -> None:
        """Records the losses [n] of n patches; an id that stands twice keeps the last one.

        NaN and Inf are recorded as 0 and counted: in proportion to its loss such a patch is not
        drawn. A loss that rounding took below 0 is recorded as 0, too.
        Raises ValueError for ids that are not stored and for other than one loss per id.
        """
        if losses.shape != ids.shape:
            raise ValueError(
                f"losses: shape {list(losses.shape)}: give one loss per id, {list(ids.shape)}"
            )
        losses = losses.detach().to(device="cpu", dtype=torch.float64)
        self._non_finite_losses += int((~losses.isfinite()).sum())
        losses = torch.where(losses.isfinite(), losses, 0.0).clamp_min(0)
        self._losses.numpy()[self._slots_of(ids)] = losses.numpy()  # one by one, in this order

    def pin(self, ids: Tensor) -> None:
        """Keeps these patches until the next call; -1 (a chain that holds no state) is skipped.

        Raises ValueError for ids that are not stored.
        """
        ids = ids[ids != -1]
        self._slots_of(ids)
        self._pinned = frozenset(ids.tolist())

    def state_dict(self) -> dict[str, Any]:
        """Everything but the patches: tensors, numbers and strings. Ids and losses are by slot."""
        return {
            "ids": self._ids[: len(self)].clone(),
            "losses": self._losses[: len(self)].clone(),
            "weights": self._weights[: len(self)].clone() if self._weighted else None,
            "waiting": self._waiting,
            "pinned": sorted(self._pinned),
            "next_id": self._next_id,
            "non_finite_losses": self._non_finite_losses,
            "buffers": list(self.layout.names),
        }

    def restore(
        self, state: dict[str, Any], parts: Iterable[tuple[Tensor, CompactPatches]]
    ) -> None:
        """Replaces all it holds by what `state_dict` gave and the patches, with their ids [k].

        Raises ValueError, and changes nothing, for a state of other buffers, for more patches than
        the capacity, and where a patch is missing.
        """
        if state["buffers"] != list(self.layout.names):
            raise ValueError(
                f"checkpoint of the store: its patches have the buffers {state['buffers']}, the "
                f"scene has {list(self.layout.names)}: it belongs to another scene"
            )
        ids: list[int] = state["ids"].tolist()
        if len(ids) > self.capacity:
            raise ValueError(
                f"checkpoint of the store: it holds {len(ids)} patches, more than the capacity "
                f"{self.capacity}: set the store's capacity to at least {len(ids)}"
            )
        blocks = PatchBlocks(capacity=self.capacity)
        slots = {patch_id: slot for slot, patch_id in enumerate(ids)}
        found: set[int] = set()
        for part_ids, compact in parts:
            blocks.write([slots[i] for i in part_ids.tolist()], self._placed(compact))
            found.update(part_ids.tolist())
        if missing := sorted(slots.keys() - found):
            raise ValueError(f"checkpoint of the store: patches {missing[:16]} are missing")

        self._blocks = blocks
        self._slots = dict(sorted(slots.items()))
        self._ids[: len(ids)] = state["ids"]
        self._losses[: len(ids)] = state["losses"]
        weights = state["weights"]
        self._weighted = weights is not None
        self._weights[: len(ids)] = 1.0 if weights is None else weights
        self._waiting = state["waiting"]
        self._pinned = frozenset(state["pinned"])
        self._next_id = state["next_id"]
        self._non_finite_losses = state["non_finite_losses"]

    def _placed(self, compact: CompactPatches) -> CompactPatches:
        """Where the store keeps its patches; the first one's size decides."""
        if self._place is None and len(compact):
            self._place = place_for(self.capacity * compact.bytes_on_device, self._device)
        return compact.to(self._place or "cpu")

    def _oldest_unpinned(self, count: int) -> list[int]:
        """Ids of the `count` patches that make room; none where `count` is not positive."""
        victims: list[int] = []
        for patch_id in self._slots:
            if len(victims) >= count:
                return victims
            if patch_id not in self._pinned:
                victims.append(patch_id)
        if len(victims) < count:
            raise ValueError(
                f"capacity: {self.capacity}: too small for the {len(self._pinned)} pinned patches "
                f"and the new ones: raise it by at least {count - len(victims)}"
            )
        return victims

    def _slots_of(self, ids: Tensor) -> list[int]:
        try:
            return [self._slots[patch_id] for patch_id in ids.tolist()]
        except KeyError as error:
            raise ValueError(
                f"patch {error.args[0]} is not in the store: it was never added or was evicted "
                "(pin the patches that are still needed)"
            ) from None
