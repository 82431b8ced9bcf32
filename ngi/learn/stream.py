"""The on-the-fly training data: explore, render, store or reuse, one batch per training step.

This is where exploration, rendering and reuse meet (paper, Sec. 5 and 6.1). The next proposals are
handed to the renderer before it is decided whether the next batch is a new one; a renderer of
several processes works on them while stored patches are trained on. The training step answers every
batch with `feedback`; without it the next batch is refused, because chains and policy would run one
step behind the network. Where they do not depend on it, `feedback_later` has it follow.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import torch

from ngi.clock.counters import Counters
from ngi.clock.phase_clock import PhaseClock
from ngi.clock.progress import Progress
from ngi.explore import ChainInfo, ChainState, ResolutionSchedule, Sampler, nothing_known
from ngi.learn.ahead import ProposalsAhead
from ngi.learn.batch import ENDLESS, Batch, Feedback
from ngi.learn.chain_trace import chain_record, chain_row
from ngi.learn.description import Description
from ngi.learn.new_losses import NewLosses
from ngi.learn.samples import Samples
from ngi.learn.saved_stores import SavedStores
from ngi.reuse import Reuse

REFUSED_IN_A_ROW = 10
"""Batches with NaN or Inf after which the renderer, not a rare v, is to blame."""

log = logging.getLogger(__name__)


class TrainingStream:
    """Endless batches of `sampler.chains` samples.

    The chains propose at the first batch and at each that follows a generated one; patches have the
    resolution of the iteration at which they were proposed.

    seed: the same seed gives the same batches on the same machine, also across a resume, and
        wherever the patches are rendered.
    Raises ValueError where samples cannot be cut from the schedule's first or last image, and
    where the store is smaller than two batches.
    """

    def __init__(
        self,
        *,
        samples: Samples,
        sampler: Sampler,
        reuse: Reuse,
        schedule: ResolutionSchedule,
        clock: PhaseClock,
        seed: int,
    ) -> None:
        for iteration in (0, ENDLESS):
            samples.check_resolution(schedule.resolution(iteration))
        reuse.check_capacity(chains=sampler.chains)
        self.sampler = sampler
        self.store = reuse.store
        self.saved_stores = SavedStores(reuse.store, reuse.archive)
        self.clock = clock
        self.counters = Counters()
        self.new_losses = NewLosses()
        self.reuse_probability = 0.0
        self.chain_record: dict[str, np.ndarray] | None = None  # of a generated batch
        self.description: Description | None = None  # of states, for samplers that need it
        self.progress: Progress | None = None  # where the last steps are on stored patches
        self._chain_info: ChainInfo | None = None
        self._samples = samples
        self.policy = reuse.policy
        self._schedule = schedule
        self._when_late = reuse.when_late
        self._generator = torch.Generator().manual_seed(seed)
        self.chains: ChainState = sampler.init(samples.dimensions + 2)  # where they stand
        self._policy_state = reuse.policy.init()
        self._resolution = schedule.resolution(0)  # of the latest proposals
        self._ahead: ProposalsAhead | None = None
        self._pending: Batch | None = None
        self._finish: Callable[[], None] | None = None  # of the step that nobody has looked at

    def __iter__(self) -> Iterator[Batch]:
        while True:
            if self._pending is not None:
                raise RuntimeError("the last batch got no feedback; call feedback() after each one")
            self._pending = self._next()
            yield self._pending

    def feedback(self, feedback: Feedback) -> None:
        """Lets chains, store and policy learn from the batch last given out."""
        batch = self._answered()
        if batch.generated:
            with self.clock.phase("explore"):
                self._accept(batch, feedback)
        self.learn(batch, feedback.losses)

    def can_do_without(self, batch: Batch) -> bool:
        """Whether the batches that follow do not depend on the losses of this one."""
        # Chains learn from generated batches only, drawing rule and policy from all.
        return not (batch.generated or self.store.draws_by_loss or self.policy.by_loss)

    def feedback_later(self, finish: Callable[[], None]) -> None:
        """Answers the last batch without its losses. RuntimeError where they are needed at once.

        finish: what is to be done once they are known, `learn` among it; `settle` calls it
        """
        if self._pending is not None and not self.can_do_without(self._pending):
            raise RuntimeError("the next batch depends on the losses of this one; call feedback()")
        self._answered()
        self._finish = finish

    def settle(self) -> None:
        """Finishes the step that is not finished yet, if there is one.

        It is called once the next step is queued, and before the store changes.
        """
        finish, self._finish = self._finish, None
        if finish is not None:
            finish()

    def learn(self, batch: Batch, losses: torch.Tensor) -> None:
        """Lets store and policy learn from a batch's losses [n]."""
        losses, large = losses.detach().float().cpu(), batch.patches.large_step.cpu()
        with self.clock.phase("reuse"):
            self.store.update(batch.ids.cpu(), losses)
            self._policy_state = self.policy.update(
                self._policy_state, reused=not batch.generated, losses=losses, large_step=large
            )

    def catch_up(self) -> None:
        """Waits, in run time, for the last step and for patches that others render.

        Call it before the clock pauses: they would go on in time that does not count.
        """
        self.settle()
        if self._ahead is not None and self._ahead.late:
            with self.clock.phase("render"):
                self._ahead.result()

    def log_row(self) -> dict[str, float | int | None]:
        """What the method did at this step: policy, store and chains; always the same keys."""
        return {
            "reuse_probability": self.reuse_probability,
            "loss_new": self._policy_state.new_loss,
            "loss_existing": self._policy_state.existing_loss,
            **self.store.log_row(),
            "resolution": self._resolution,
            **vars(self.counters),
            **chain_row(self._chain_info),
        }

    def state_dict(self) -> dict[str, Any]:
        """Everything the next batch depends on; patches go to the archive, not in here."""
        if self._finish is not None:
            raise RuntimeError("the last step is not finished; call settle() before it is saved")
        return {
            "counters": dict(vars(self.counters)),
            "new_losses": self.new_losses.state_dict(),
            "chains": self.chains.state_dict(),
            "policy": self._policy_state.state_dict(),
            "generator": self._generator.get_state(),
            "ahead": None if self._ahead is None else self._ahead.state_dict(),
            "store": self.saved_stores.save(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self.counters = Counters(**state["counters"])
        self.new_losses.load_state_dict(state["new_losses"])
        self.chains = type(self.chains).from_state_dict(state["chains"])
        self._policy_state = type(self._policy_state).from_state_dict(state["policy"])
        self._generator.set_state(state["generator"])
        ahead = state["ahead"]
        self._ahead = None if ahead is None else ProposalsAhead.from_state_dict(ahead)
        self.saved_stores.restore(state["store"])

    def _next(self) -> Batch:
        ahead = self._propose()
        with self.clock.phase("reuse"):
            self.reuse_probability = self.policy.probability(
                self._policy_state,
                generated_batches=self.counters.generated_batches,
                store_size=len(self.store),
                store_capacity=self.store.capacity,
            )
            reused = self.policy.reuses(
                self.reuse_probability,
                draw=torch.rand((), generator=self._generator, dtype=torch.float64).item(),
                batches=self.counters.iteration,
                generated_batches=self.counters.generated_batches,
            )
            if reused or self._put_off(ahead):
                ids = self.store.draw(self.sampler.chains, self._generator)
                return Batch(
                    self._samples.rearranged(self.store.get(ids), self._generator),
                    ids,
                    generated=False,
                    current=None,
                    loss_weights=self.store.loss_weights(ids),
                )
        return self._generate(ahead)

    def _propose(self) -> ProposalsAhead:
        """The proposals under way, drawn where there are none, and started where nobody is at it.

        What is drawn, and when, does not depend on where and how fast it is rendered.
        """
        if self._ahead is None:
            with self.clock.phase("explore"):
                resolution = self._schedule.resolution(self.counters.iteration)
                proposals = self.sampler.propose(
                    self.chains,
                    self._generator,
                    batch=self.counters.proposed_batches,
                    describe=self.description.at(resolution) if self.description else nothing_known,
                )
                seed = int(torch.randint(2**31, (), generator=self._generator))
                self._ahead = ProposalsAhead(proposals, resolution=resolution, seed=seed)
        self._resolution = self._ahead.resolution
        with self.clock.phase("render"):
            self._ahead.start(self._samples)
        return self._ahead

    def _put_off(self, ahead: ProposalsAhead) -> bool:
        if self.reuse_probability == 0:
            return False
        if self.progress is not None and self.progress.too_late:
            return True
        postponed = self._when_late == "reuse" and ahead.late
        self.counters.batches_postponed += postponed
        return postponed

    def _answered(self) -> Batch:
        if self._pending is None:
            raise RuntimeError("feedback without a batch")
        batch, self._pending = self._pending, None
        self._chain_info = self.chain_record = None
        self.counters.iteration += 1
        return batch

    def _generate(self, ahead: ProposalsAhead) -> Batch:
        ahead = self._usable(ahead)
        self.counters.count_generated(ahead.result())
        self.settle()
        with self.clock.phase("reuse"):
            ids = self.store.add(ahead.patches(), ahead.proposals.weight)
            patches = self.store.get(ids)  # in the precision of every later look at them
            score_current = self.sampler.needs_current and bool(self.chains.occupied.all())
            current = self.store.get(self.chains.patch) if score_current else None
        self.counters.scored_batches += score_current
        return Batch(
            patches,
            ids,
            generated=True,
            current=current,
            loss_weights=ahead.proposals.weight,
            first_half=ahead.result().first_half,
        )

    def _usable(self, ahead: ProposalsAhead) -> ProposalsAhead:
        """The proposals, rendered, or others for NaN or Inf; FloatingPointError where none help."""
        for _ in range(REFUSED_IN_A_ROW):
            with self.clock.phase("render"):
                problem = ahead.unusable()
            if problem is None:
                return ahead
            self.counters.batches_refused += 1
            log.warning("%s; rendering other patches instead", problem)
            self.settle()  # others are proposed by weights that might be taken back later
            self._ahead = None
            ahead = self._propose()
        raise FloatingPointError(
            f"{problem}, and in the {REFUSED_IN_A_ROW - 1} batches before: the renderer cannot "
            "make usable patches of this scene"
        )

    def _accept(self, batch: Batch, feedback: Feedback) -> None:
        assert self._ahead is not None
        proposals = self._ahead.proposals
        unscored = torch.zeros(self.sampler.chains)  # looked at by no rule
        losses = self.new_losses.add(feedback.losses.detach().float().cpu(), feedback.noise)
        proposed, current = feedback.target_proposed, feedback.target_current
        self.chains, self._chain_info = self.sampler.accept(
            self.chains,
            proposals,
            batch.ids,
            target_current=unscored if current is None else current,
            target_proposed=unscored if proposed is None else proposed,
            generator=self._generator,
            losses=losses if self.description is None else self.description.errors(batch.patches),
        )
        self.chain_record = chain_record(
            proposals, self._chain_info, target_proposed=proposed, target_current=current
        )
        self._ahead = None
        self.store.pin(self.chains.patch)
