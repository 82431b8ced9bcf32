"""The on-the-fly training data: explore, render, store or reuse, one batch per training step.

This is where exploration, rendering and reuse take turns (paper, Sec. 5 and 6.1). The training
step answers every batch with `feedback`; without it the next batch is refused, because chains and
policy would run one step behind the network.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.utils.data import IterableDataset

from ngi.explore import ChainInfo, ChainState, MarkovChains, Proposals, ResolutionSchedule
from ngi.learn.clock import PhaseClock
from ngi.patches import Patches
from ngi.render.protocol import Renderer
from ngi.reuse import PatchArchive, PatchStore, ReusePolicy


@dataclass(frozen=True)
class Batch:
    """One training batch.

    patches: [n] what is trained on: the proposals just rendered, or stored patches
    ids: [n] int64, their identities in the store
    generated: whether they were rendered for this batch
    current: [n] the chains' current states, to be scored beside the proposals; None where the
        acceptance rule does not look at them, on the first batch, and on reuse
    """

    patches: Patches
    ids: Tensor
    generated: bool
    current: Patches | None

    def to(self, device: torch.device | str) -> Batch:
        current = None if self.current is None else self.current.to(device)
        return Batch(self.patches.to(device), self.ids.to(device), self.generated, current)


@dataclass(frozen=True)
class Feedback:
    """What the training step learnt from a batch, all under the weights before that step.

    losses: [n] loss per sample
    target_proposed: [n] target density of the proposals, which the step's backward pass brings;
        None where nothing had to be scored
    target_current: [n] that of the chains' current states
    """

    losses: Tensor
    target_proposed: Callable[[], Tensor] | None
    target_current: Tensor | None


@dataclass
class Counters:
    """Running totals of a run; all are logged and checkpointed."""

    iteration: int = 0
    generated_batches: int = 0
    patches_traced: int = 0
    paths_traced: int = 0
    patches_repaired: int = 0
    patches_masked: int = 0


ENDLESS = 2**31
"""The length of a stream. Lightning prefetches one batch of a dataset without a length, and the
sampler would run one step behind the network."""


class TrainingStream(IterableDataset[Batch]):
    """Endless batches of `sampler.chains` patches.

    seed: the same seed gives the same batches on the same machine, also across a resume.
    Raises ValueError where the schedule's first image is smaller than a patch, or the store than
    two batches.
    """

    def __init__(
        self,
        *,
        renderer: Renderer,
        sampler: MarkovChains,
        store: PatchStore,
        archive: PatchArchive,
        policy: ReusePolicy,
        schedule: ResolutionSchedule,
        clock: PhaseClock,
        seed: int,
    ) -> None:
        super().__init__()
        if schedule.resolution(0) < renderer.patch_size:
            raise ValueError(
                f"resolution: the image has {schedule.resolution(0)} pixels a side, less than a "
                f"patch of {renderer.patch_size}; raise resolution or lower renderer.patch_size"
            )
        if store.capacity < 2 * sampler.chains:
            raise ValueError(
                f"reuse.store.capacity: {store.capacity} patches do not hold the chains' current "
                f"states and a new batch; expected at least {2 * sampler.chains}"
            )
        self.sampler = sampler
        self.store = store
        self.counters = Counters()
        self.reuse_probability = 0.0
        self._chain_info: ChainInfo | None = None
        self._renderer = renderer
        self._archive = archive
        self._policy = policy
        self._schedule = schedule
        self._clock = clock
        self._generator = torch.Generator().manual_seed(seed)
        self._chains: ChainState = sampler.init(renderer.dimensions + 2)
        self._policy_state = policy.init()
        self._batch_resolution = self.resolution
        self._saved_store: dict[str, Any] | None = None
        self._pending: tuple[Batch, Proposals | None] | None = None

    def __len__(self) -> int:
        return ENDLESS

    def __iter__(self) -> Iterator[Batch]:
        while True:
            if self._pending is not None:
                raise RuntimeError("the last batch got no feedback; call feedback() after each one")
            batch, proposals = self._next()
            self._pending = (batch, proposals)
            yield batch

    @property
    def resolution(self) -> int:
        """Pixels along a side of the virtual image at the present iteration."""
        return self._schedule.resolution(self.counters.iteration)

    def feedback(self, feedback: Feedback) -> None:
        """Lets chains, store and policy learn from the batch last given out."""
        if self._pending is None:
            raise RuntimeError("feedback without a batch")
        batch, proposals = self._pending
        self._pending = None
        losses = feedback.losses.detach().float().cpu()
        self._batch_resolution = self.resolution
        with self._clock.phase("explore"):
            self._chain_info = None
            if proposals is not None:
                self._accept(batch, proposals, feedback)
        with self._clock.phase("reuse"):
            self.store.update(batch.ids.cpu(), losses)
            self._policy_state = self._policy.update(
                self._policy_state,
                reused=not batch.generated,
                losses=losses,
                large_step=batch.patches.large_step.cpu(),
            )
        self.counters.iteration += 1

    def log_row(self) -> dict[str, float | int | None]:
        """What the method did at this step: policy, store and chains; always the same keys."""
        info = self._chain_info
        return {
            "reuse_probability": self.reuse_probability,
            "loss_new": self._policy_state.new_loss,
            "loss_existing": self._policy_state.existing_loss,
            "store_size": len(self.store),
            "store_mean_age": self.store.mean_age,
            "store_mean_loss": self.store.mean_loss,
            "non_finite_losses": self.store.non_finite_losses,
            "resolution": self._batch_resolution,
            **vars(self.counters),
            "acceptance_rate": None if info is None else info.acceptance_rate,
            "large_step_acceptance_rate": None if info is None else info.large_step_acceptance_rate,
            "small_step_acceptance_rate": None if info is None else info.small_step_acceptance_rate,
            "chain_mean_age": None if info is None else info.mean_age,
        }

    def state_dict(self) -> dict[str, Any]:
        """Everything the next batch depends on; patches go to the archive, not in here."""
        self._saved_store = self._archive.save(self.store)
        return {
            "counters": dict(vars(self.counters)),
            "chains": self._chains.state_dict(),
            "policy": self._policy_state.state_dict(),
            "generator": self._generator.get_state(),
            "store": self._saved_store,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self.counters = Counters(**state["counters"])
        self._chains = ChainState.from_state_dict(state["chains"])
        self._policy_state = type(self._policy_state).from_state_dict(state["policy"])
        self._generator.set_state(state["generator"])
        self._archive.restore(self.store, state["store"])
        self._saved_store = state["store"]

    def prune_archive(self) -> None:
        """Deletes patches that the last saved state does not need; call it once that is on disk."""
        if self._saved_store is not None:
            self._archive.prune([self._saved_store])

    def _next(self) -> tuple[Batch, Proposals | None]:
        with self._clock.phase("reuse"):
            self.reuse_probability = self._policy.probability(
                self._policy_state,
                generated_batches=self.counters.generated_batches,
                store_size=len(self.store),
                store_capacity=self.store.capacity,
            )
            draw = torch.rand((), generator=self._generator, dtype=torch.float64)
            if draw < self.reuse_probability:
                ids = self.store.draw(self.sampler.chains, self._generator)
                return Batch(self.store.get(ids), ids, generated=False, current=None), None
        return self._generate()

    def _generate(self) -> tuple[Batch, Proposals]:
        with self._clock.phase("explore"):
            proposals = self.sampler.propose(self._chains, self._generator)
            seed = int(torch.randint(2**31, (), generator=self._generator))
        with self._clock.phase("render"):
            rendered = self._renderer.render_patches(
                proposals.position, resolution=self.resolution, seed=seed
            )
        patches = Patches(
            scene_vector=proposals.position[:, :-2],
            position=proposals.position[:, -2:],
            resolution=torch.full((len(proposals.position),), self.resolution),
            large_step=proposals.large_step,
            buffers=rendered.buffers,
            log_radiance=rendered.log_radiance,
        )
        self.counters.generated_batches += 1
        self.counters.patches_traced += len(patches)
        self.counters.paths_traced += rendered.paths
        self.counters.patches_repaired += rendered.repaired
        self.counters.patches_masked += rendered.masked
        with self._clock.phase("reuse"):
            ids = self.store.add(patches)
            patches = self.store.get(ids)  # in the precision of every later look at them
            score_current = self.sampler.needs_current and bool(self._chains.occupied.all())
            current = self.store.get(self._chains.patch) if score_current else None
        return Batch(patches, ids, generated=True, current=current), proposals

    def _accept(self, batch: Batch, proposals: Proposals, feedback: Feedback) -> None:
        unscored = torch.zeros(self.sampler.chains)  # looked at by no rule
        proposed, current = feedback.target_proposed, feedback.target_current
        self._chains, self._chain_info = self.sampler.accept(
            self._chains,
            proposals,
            batch.ids,
            target_current=unscored if current is None else current,
            target_proposed=unscored if proposed is None else proposed(),
            generator=self._generator,
        )
        self.store.pin(self._chains.patch)
