"""Targets of which nearly nothing is worth a visit, and scenes that one variable decides."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import product

import torch
from torch import Tensor

from ngi.explore import (
    Acceptance,
    ConstantTarget,
    Greedy,
    MarkovChains,
    Metropolis,
    NormalPerturbation,
)
from ngi.studies.stability.case import PRECISIONS, SAMPLERS, Case, Conditions, Outcome
from ngi.studies.stability.training_run import train

CHAINS = 16
STEPS = 20_000
HEIGHT = 1000.0
"""Of the target in the pocket; 1 elsewhere."""

LEARNT = 0.99
"""What a visit leaves of the target, where visits teach."""

ACCEPTANCE: dict[str, Acceptance] = {
    "greedy": Greedy(accept_equal=False),
    "Metropolis": Metropolis(),
}

WRAPPED = 1e6
"""Standard deviation of small steps in sides of the hypercube."""


@dataclass(frozen=True, kw_only=True)
class Walk:
    """What chains did on a target of known density.

    inside: part of the states in the pocket
    first: steps until the first chain was there, None if none was
    acceptance: accepted part of the proposals
    longest_stay: of a chain in one state, in steps
    distance: that a chain travelled per step, on the torus, in sides of the hypercube
    """

    inside: float
    first: int | None
    acceptance: float
    longest_stay: int
    distance: float

    @property
    def text(self) -> str:
        """For the report."""
        found = "never found" if self.first is None else f"found after {self.first:,} steps"
        return (
            f"{found}, {self.inside:.2g} of the states in it, acceptance {self.acceptance:.2g}, "
            f"longest stay {self.longest_stay:,} steps, {self.distance:.2g} travelled per step"
        )


def walk(
    acceptance: Acceptance, *, dimensions: int, volume: float, learns: bool, steps: int = STEPS
) -> Walk:
    """Chains on a box of the given volume in the first two variables; the others decide nothing.

    learns: every visit of a chain lowers the height, and every step the target of the state it
        stands in, as training does
    """
    chains = MarkovChains(
        chains=CHAINS,
        proposal=NormalPerturbation(large_step_probability=0.3, standard_deviation=0.045),
        target=ConstantTarget(),  # the density is given below
        acceptance=acceptance,
    )
    generator = torch.Generator().manual_seed(0)
    state, ids = chains.init(dimensions + 2), torch.arange(CHAINS)
    side, height, first = math.sqrt(volume), HEIGHT, None
    inside = accepted = longest = 0
    distance = 0.0
    for step in range(1, steps + 1):
        proposals = chains.propose(state, generator, batch=step - 1)
        current, proposed = (
            torch.where(_inside(position, side), height, 1.0)
            for position in (state.position, proposals.position)
        )
        if learns:
            current = current * LEARNT**state.age
        moved, info = chains.accept(state, proposals, ids, current, proposed, generator)
        offset = (moved.position - state.position + 0.5) % 1 - 0.5
        if step > 1:
            distance += float(offset.norm(dim=1).mean())
        here = int(_inside(moved.position, side).sum())
        state = moved
        first = step if first is None and here else first
        height = max(1.0, height * LEARNT**here) if learns else height
        inside, accepted = inside + here, accepted + int(info.accepted.sum())
        longest = max(longest, int(state.age.max()))
    total = steps * CHAINS
    return Walk(
        inside=inside / total,
        first=first,
        acceptance=accepted / total,
        longest_stay=longest,
        distance=distance / steps,
    )


def _inside(position: Tensor, side: float) -> Tensor:
    return (position[:, :2] < side).all(dim=1)


def _known_density(_: Conditions, *, rule: str, dimensions: int, volume: float) -> Outcome:
    """A target that stays as it is.

    Metropolis is to be in the pocket as often as its share of the mass says, where large steps can
    find it at all; greedy chains, once there, stay.
    """
    done = walk(ACCEPTANCE[rule], dimensions=dimensions, volume=volume, learns=False)
    share = HEIGHT * volume / (HEIGHT * volume + 1 - volume)
    findable = 0.3 * volume * STEPS * CHAINS > 10  # large steps into the pocket, in the mean
    if rule == "greedy":
        # A chain enters with probability 0.3 · volume per step, and leaves no more.
        rate = 0.3 * volume
        share = 1 - (1 - (1 - rate) ** STEPS) / (rate * STEPS)
    return Outcome(
        finite=math.isfinite(done.distance),
        error=abs(done.inside - share),
        limit=0.15 if findable else None,
        done=done.text,
        as_expected=done.first is not None or not findable,
    )


def _learnt_density(_: Conditions, *, rule: str, dimensions: int) -> Outcome:
    """A target that falls where chains are: none may stay for good."""
    done = walk(ACCEPTANCE[rule], dimensions=dimensions, volume=1e-3, learns=True)
    return Outcome(
        finite=math.isfinite(done.distance),
        done=done.text,
        as_expected=done.first is not None and done.longest_stay < STEPS / 2,
    )


def _wrap_around(_: Conditions) -> Outcome:
    """Small steps many hypercubes wide, from its corners: every state is in [0, 1)."""
    proposal = NormalPerturbation(large_step_probability=0.0, standard_deviation=WRAPPED)
    corners = torch.tensor(list(product((0.0, 1.0), repeat=8)))
    generator = torch.Generator().manual_seed(0)
    states = [proposal.propose(corners, generator, batch=0).position for _ in range(200)]
    tiny = NormalPerturbation(large_step_probability=0.0, standard_deviation=1e-12)
    states += [tiny.propose(corners, generator, batch=0).position for _ in range(200)]
    position = torch.stack(states)
    return Outcome(
        finite=bool(position.isfinite().all()),
        done="wrapped around",
        as_expected=bool(((position >= 0) & (position < 1)).all()),
    )


def _stiff_scene(conditions: Conditions, *, dimensions: int, volume: float) -> Outcome:
    """Effects switched on within 0.001 of one variable, beside variables that decide nothing."""
    scene = {"dimensions": dimensions, "volume": volume, "active": 1, "sharpness": 1.0}
    trained = train(conditions, overrides=[f"++renderer.{k}={v}" for k, v in scene.items()])
    norms = trained.gradient_norms
    return Outcome(
        finite=trained.weights_finite and all(map(math.isfinite, norms)),
        error=trained.error,
        done=f"largest gradient {max(norms):.2g}, longest stay {trained.longest_stay} batches",
        as_expected=trained.stopped is None,
    )


CASES = (
    *(
        Case(
            f"{rule}, pocket of {volume:g} in {dimensions} dimensions",
            partial(_known_density, rule=rule, dimensions=dimensions, volume=volume),
            {},
        )
        for volume, dimensions, rule in product((1e-3, 1e-6), (2, 12, 128), ACCEPTANCE)
    ),
    *(
        Case(
            f"{rule}, pocket that is learnt, in {dimensions} dimensions",
            partial(_learnt_density, rule=rule, dimensions=dimensions),
            {},
        )
        for dimensions, rule in product((2, 128), ACCEPTANCE)
    ),
    Case("steps of a million hypercubes, from its corners", _wrap_around, {}),
    *(
        Case(
            f"0.001 of one of {dimensions} variables decides",
            partial(_stiff_scene, dimensions=dimensions, volume=1e-3),
            {"sampler": SAMPLERS, "precision": PRECISIONS},
        )
        for dimensions in (2, 128)
    ),
)
