"""One run of the study: patches come in rounds, and a rule says which."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor

from ngi.evaluate import METRICS, SETS, Evaluation, Evaluator
from ngi.learn.new_losses import worst_share
from ngi.reuse import CompactPatches
from ngi.studies.ceiling.choices import Choice, errors_of
from ngi.studies.ceiling.pool import chosen
from ngi.studies.ceiling.training import Training


class Run(NamedTuple):
    """patches: in all; steps: in all; choice: a name in `ceiling.choices`; seed: of weights too."""

    patches: int
    steps: int
    choice: str
    seed: int

    @property
    def name(self) -> str:
        """For a file."""
        return f"patches={self.patches},steps={self.steps},{self.choice},seed={self.seed}"


def plan(
    *,
    pool: int,
    sizes: Sequence[Mapping[str, int]],
    rounds: int,
    choices: Sequence[str],
    seeds: int,
) -> Iterator[Run]:
    """All runs, the first seed of all of them first; with the whole pool there is no choice.

    sizes: patches and steps of runs; the whole pool is trained on for as many steps as any of them
    Raises ValueError for a size without a choice or with fewer patches than rounds, and for one
    that is given twice.
    """
    for size in sizes:
        if size["patches"] < rounds:
            raise ValueError(
                f"ceiling.sizes: {size['patches']} patches do not come in {rounds} rounds; give "
                f"at least as many, or fewer ceiling.rounds"
            )
        if size["patches"] >= pool:
            raise ValueError(
                f"ceiling.sizes: {size['patches']} patches of a pool of {pool} leave no choice; "
                "raise ceiling.pool (the whole pool is trained on in any case)"
            )
        if sizes.count(size) > 1:
            raise ValueError(f"ceiling.sizes: {dict(size)} is given twice")
    lengths = dict.fromkeys(size["steps"] for size in sizes)
    of_the_pool = [{"patches": pool, "steps": steps} for steps in lengths]
    for seed in range(seeds):
        for size in (*sizes, *of_the_pool):
            for choice in choices if size["patches"] < pool else choices[:1]:
                yield Run(size["patches"], size["steps"], choice, seed)


def do(
    run: Run,
    training: Training,
    *,
    pool: CompactPatches,
    truth: Tensor,
    choice: Choice,
    rounds: int,
    evaluator: Evaluator,
) -> dict[str, Any]:
    """Trains, and gives the run's row: itself, and the errors of its end.

    Patches come in `rounds` rounds, evenly over the steps. The first is drawn uniformly, for an
    untrained network has nothing to say, and is the same for all choices of a seed; the others by
    `choice`, out of all patches not yet chosen. What the row says beside the errors of `measured`
    is `worst_share`, the share of these patches' error that the worst 5 % of them hold at the end;
    with the whole pool chosen, of all patches.

    truth: [m, h, w, 3] log1p radiance of the pool, see `Training.answers`
    """
    generator = torch.Generator().manual_seed(run.seed)
    left = torch.ones(len(pool), dtype=torch.bool)
    for number in range(rounds):
        candidates = left.nonzero().flatten()
        count = _part(run.patches, number, rounds)
        if number == 0 or choice.importance.uniform_share == 1:
            drawn = torch.randperm(len(candidates), generator=generator)[:count]
            weights = torch.ones(count, dtype=torch.float64)
        else:
            values = choice.values(candidates, count, generator)
            drawn, weights = choice.importance.draw(values, count, generator)
        choice.chose(candidates[drawn])
        training.add(chosen(pool, candidates[drawn]), weights)
        left[candidates[drawn]] = False
        training.train(_part(run.steps, number, rounds))
    rest = left.nonzero().flatten() if left.any() else torch.arange(len(pool))
    share = worst_share(errors_of(rest, training.errors, pool=pool, truth=truth))
    return {**run._asdict(), **measured(evaluator.evaluate(training.predict)), "worst_share": share}


def measured(evaluation: Evaluation) -> dict[str, float]:
    """Per set: every metric, their geometric mean as `SET_error`, `SET_relmse` and `SET_tail`."""
    row = evaluation.row()
    result: dict[str, float] = {}
    for name in SETS:
        keys = [f"{name}_{metric}" for metric in (*METRICS, "relmse", "tail")]
        result |= {key: float(value) for key in keys if (value := row[key]) is not None}
        known = [result[key] for key in keys[: len(METRICS)] if key in result]
        result[f"{name}_error"] = math.exp(sum(math.log(value) for value in known) / len(known))
    return result


def _part(whole: int, number: int, parts: int) -> int:
    """The share of part `number` of so many nearly equal ones."""
    return whole * (number + 1) // parts - whole * number // parts
