"""What is varied on the map: the scene's knobs, the network's size, and the methods compared."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

TARGETS = {
    "loss": "ngi.explore.Loss",
    "loss_step": "ngi.explore.LossTimesStep",
    "output_gradient": "ngi.explore.LossTimesOutputGradient",
}
ACCEPTANCES = {"greedy": "mcmc_loss_step", "metropolis": "mcmc_metropolis"}
"""And the option of the program's configuration that has it, all else being the same."""

UNIFORM, PREDICTED, EAGER = "uniform", "predicted", "eager"
PREDICTING = {PREDICTED: "predicted_loss", EAGER: "predicted_loss_eager"}
"""Samplers without chains, and the option of the program's configuration that each is."""

LARGE_STEPS = "_large_steps"
"""Ends the name of chains that propose as many small steps as the paper's propose large ones."""

SAMPLERS = (UNIFORM, *(f"{target}_{rule}" for target, rule in product(TARGETS, ACCEPTANCES)))

SELF_TUNING = ("reuse=self_tuning", "reuse.policy.bootstrap_batches=20", "reuse.policy.beta=2.0")
"""With the paper's 100 and 4.6 hardly a batch would be new: by 2.0 it is 14 % at equal losses."""
BY_SAMPLES = ("reuse=by_samples", "reuse.policy.stored_alone=0")
"""That of `method=ours` when the map was made, whoever chooses the samples."""
BY_LOSS = ("reuse=by_loss",)
"""The same, stored patches drawn with replacement, a tenth in proportion to their losses."""
NO_REUSE = ("reuse=never",)


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One point of the map; the defaults are the point that single knobs are varied from.

    All but hidden_features, the width of the network, are arguments of `ngi.render.PocketRenderer`.
    """

    volume: float = 0.01
    dimensions: int = 8
    active: int = 4
    pockets: int = 1
    sharpness: float = 0.0
    noise: float = 0.0
    hidden_features: int = 64

    @property
    def scene(self) -> dict[str, Any]:
        """The renderer's arguments."""
        return {name: value for name, value in asdict(self).items() if name != "hidden_features"}

    @property
    def name(self) -> str:
        """For a folder: 'volume=0.01,dimensions=8,…'."""
        return ",".join(f"{name}={value:g}" for name, value in asdict(self).items())


@dataclass(frozen=True)
class Method:
    """A way of choosing samples.

    sampler: one of `SAMPLERS`: "uniform", or a target and an acceptance rule, which `LARGE_STEPS`
        may follow; or of `PREDICTING`; or of `KNOWN`, which takes the place of the uniform one
    reuse: whether stored patches are trained on again, as the plan says
    """

    sampler: str
    reuse: bool

    @property
    def predicts(self) -> bool:
        """Whether states are drawn by their predicted losses, without chains."""
        return self.sampler in PREDICTING

    @property
    def name(self) -> str:
        """For a file: 'loss_greedy', 'loss_greedy-reuse'."""
        return self.sampler + "-reuse" * self.reuse

    @property
    def overrides(self) -> list[str]:
        """What it changes in the program's configuration, beside the reuse."""
        if self.sampler == UNIFORM or self.sampler in KNOWN:
            return [f"sampler={UNIFORM}"]
        if self.predicts:
            return [f"sampler={PREDICTING[self.sampler]}"]
        target, rule = self.sampler.removesuffix(LARGE_STEPS).rsplit("_", 1)
        chains = [f"sampler={ACCEPTANCES[rule]}", f"sampler.target._target_={TARGETS[target]}"]
        if self.sampler.endswith(LARGE_STEPS):
            chains.append("sampler.proposal.large_step_probability=0.7")
        return chains


KNOWN = {"known": False, "known_weighted": True}
"""Samplers that know the pockets, and whether losses are weighted back to uniform states."""

KNOWN_SHARE = 0.1
"""Of their states, that is drawn from the pockets."""

OURS = tuple(Method(sampler, reuse) for reuse in (False, True) for sampler in (UNIFORM, PREDICTED))
"""Of the map with our learner."""

CHAINS = tuple(
    Method("loss_greedy" + steps, reuse) for reuse in (False, True) for steps in ("", LARGE_STEPS)
)
"""The best chains of the map, with the paper's steps and with fewer small ones."""

AT_MOST = tuple(Method(sampler, reuse=False) for sampler in (UNIFORM, PREDICTED, *KNOWN))
"""What could be gained, and what is."""

METHODS = tuple(Method(sampler, reuse) for reuse, sampler in product((False, True), SAMPLERS))
