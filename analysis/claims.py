"""What the paper claims, as data: statement, source, and the comparisons that test it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

SEVEN_SCENES = (
    "sphere-caustic",
    "living-room",
    "bedroom",
    "veach-door",
    "bathroom",
    "spaceship",
    "veach-egg",
)
CNSR_SCENES = ("living-room", "bedroom", "veach-door")
ANF_SCENES = ("spaceship", "living-room", "veach-egg")
SALONS = ("salon-5", "salon-7", "salon-9", "salon-10", "salon-25")


@dataclass(frozen=True)
class Comparison:
    """`better` is claimed to have less error than `worse` after the same time, on every scene.

    better, worse: options of the configuration group `method`. decides: whether the claim's
    verdict depends on it; otherwise it is shown beside the claim.
    """

    scenes: tuple[str, ...]
    better: str
    worse: str
    decides: bool = True


@dataclass(frozen=True)
class Claim:
    """One claim of the paper.

    id: name of the sweep that tests it; title: a few words; statement: what the paper says, in our
    words; source: where it says so; test: what we measure and when we call it reproduced, where
    the comparisons alone do not say it; primary: the one test that can refute the claim, its first
    comparison or its first finding; reuse: of the group `reuse`, that it is about runs with; None
    for any, the same for what is compared; against: further scenes, with which its finding compares
    the first comparison's, of the method claimed to be better; with_ours: whether it is judged with
    our learner in place of the paper's; command: what runs it.
    """

    id: str
    title: str
    statement: str
    source: str
    comparisons: tuple[Comparison, ...] = ()
    test: str = ""
    primary: Literal["comparison", "finding"] = "comparison"
    reuse: str | None = None
    against: tuple[str, ...] = ()
    with_ours: bool = False

    @property
    def command(self) -> str:
        return f"make report SWEEPS={self.id}"


_OF_THE_PAPER = (
    Claim(
        id="same_time",
        title="Active Exploration against uniform sampling",
        statement="After the same training time exploration gives sharper reflections, caustics "
        "and shadows and less error than uniform sampling with the same sample reuse, which ends "
        "at a low quality that more training does not improve.",
        source="Sec. 7.2.1; Tab. 3; Fig. 11, 13",
        comparisons=(
            Comparison(SEVEN_SCENES, "active_exploration", "uniform"),
            Comparison(SEVEN_SCENES, "constant_resolution", "uniform", decides=False),
        ),
    ),
    Claim(
        id="preconditioning",
        title="Position preconditioning",
        statement="Passing the position alone through the first layer greatly improves the "
        "result: the network learns to ignore the table's texture where it shades the caustic.",
        source="Sec. 4.2, 7.3; Tab. 5; Fig. 16",
        comparisons=(Comparison(("living-room",), "active_exploration", "no_preconditioning"),),
    ),
    Claim(
        id="resolution",
        title="Growing resolution",
        statement="A resolution that grows while training lets exploration resolve reflections "
        "and shadows; under uniform sampling it makes the result worse.",
        source="Sec. 6.2, 7.3; Tab. 6; Fig. 7",
        comparisons=(
            Comparison(("living-room",), "active_exploration", "constant_resolution"),
            Comparison(("living-room",), "uniform", "uniform_growing"),
            Comparison(("living-room",), "active_exploration", "uniform", decides=False),
        ),
    ),
    Claim(
        id="target_function",
        title="Target function: loss times step",
        statement="With the loss alone as the chains' target, training gets stuck in states that "
        "cannot be improved any more, and the result is blurrier than with loss times the norm of "
        "the Adam step.",
        source="Sec. 5.1, 7.3; Tab. 7; Fig. 17",
        comparisons=(
            Comparison(("living-room",), "active_exploration", "loss_target"),
            Comparison(
                ("living-room",), "output_gradient_target", "active_exploration", decides=False
            ),
        ),
    ),
    Claim(
        id="acceptance",
        title="Greedy acceptance",
        statement="The acceptance rule of Metropolis and Hastings does not converge to the "
        "target distribution before that has changed; accepting only what is better does.",
        source="Sec. 5.1; Eq. 3, 4",
        comparisons=(
            Comparison(("sphere-caustic", "living-room"), "active_exploration", "metropolis"),
        ),
    ),
    Claim(
        id="histogram",
        title="Samples follow the target function",
        statement="Without reuse, in a room with a mirror, the histogram of the chains' samples "
        "starts to follow the target function after a burn-in, and the figure's reflection "
        "appears much sooner than with uniform sampling.",
        source="Sec. 5.1; Fig. 6",
        comparisons=(Comparison(("mirror",), "active_exploration", "uniform"),),
        test="The distance between histogram and target map falls from the first to the last "
        "third of the run, for greedy acceptance and for Metropolis, by more than for uniform "
        "sampling.",
        primary="finding",
        reuse="never",
    ),
    Claim(
        id="dimensions",
        title="More variables, more benefit",
        statement="On Salon the benefit of exploration over uniform sampling is small for 5 "
        "variables and in general grows with their number and complexity; albedos add less than "
        "a moving light.",
        source="Sec. 7.3; Fig. 14",
        comparisons=tuple(
            Comparison((salon,), "active_exploration", "uniform", decides=False) for salon in SALONS
        ),
        test="The log ratio of the errors (exploration over uniform) falls with the logarithm of "
        "the number of variables.",
        primary="finding",
    ),
    Claim(
        id="specular",
        title="Training time and traced specular bounces",
        statement="Quality grows with the hours of training; with specular bounces traced instead "
        "of learnt, results are acceptable after half an hour.",
        source="Sec. 7.1; Fig. 9, 10",
        comparisons=(Comparison(("bedroom",), "traced_specular", "active_exploration"),),
        test="Traced bounces give less error after the same time, and without them the error "
        "still falls in the second half of the run.",
    ),
    Claim(
        id="cnsr",
        title="Against Compositional Neural Scene Representations",
        statement="At the same quality training takes a fraction of CNSR's time; after the same "
        "time the error is lower.",
        source="Sec. 7.2.2; Fig. 12",
        comparisons=(
            Comparison(CNSR_SCENES, "active_exploration", "cnsr"),
            Comparison(CNSR_SCENES, "uniform", "cnsr", decides=False),
        ),
    ),
    Claim(
        id="anf",
        title="Against path tracing with the denoiser ANF at 8 samples per pixel",
        statement="After the same training time the error is lower than that of path tracing at 8 "
        "samples per pixel with the denoiser ANF. (The paper fine-tunes the authors' pretrained "
        "ANF on as many pixels as its own method generates; here ANF starts from random weights. "
        "A frame of ANF takes longer than the network's.)",
        source="Sec. 7.2.3; Tab. 4; Fig. 15",
        comparisons=(Comparison(ANF_SCENES, "active_exploration", "anf"),),
    ),
    Claim(
        id="chess",
        title="128 variables",
        statement="With 128 variables results are still plausible, with some shadows and "
        "highlights missing.",
        source="Sec. 8; Fig. 18",
        comparisons=(Comparison(("chess",), "active_exploration", "uniform", decides=False),),
        test="Plausible: after the same time DSSIM and LPIPS on the hard frames are not higher "
        "than those of the worst of the seven scenes, and lower than at the first evaluation.",
        primary="finding",
        against=SEVEN_SCENES,
    ),
)

WITH_OURS = {
    "active_exploration": "ours_exploring",
    "uniform": "ours_uniform",
    "loss_target": "ours_loss_target",
    "metropolis": "ours_metropolis",
}
"""Samplings of the paper, and the same with our learner, whose resolution is constant."""

_OF_CLAIMS = {
    "preconditioning": {
        "active_exploration": "ours_paper_network",
        "no_preconditioning": "ours_no_preconditioning",
    },
    "resolution": {
        "active_exploration": "ours_exploring_growing",
        "constant_resolution": "ours_exploring",
        "uniform_growing": "ours_uniform_growing",
    },
    "specular": {
        "traced_specular": "ours_exploring",
        "active_exploration": "ours_learned_specular",
    },
    "cnsr": {"cnsr": "cnsr"},
    "anf": {"anf": "anf"},
}
"""By a claim's id, what it compares beside samplings, or in which our learner differs by itself."""

_DIFFERENCES = {
    "preconditioning": "The network is the paper's, all else ours, caustics traced.",
    "resolution": "The constant resolution is that of the frames that are shown.",
    "specular": "Direct light and caustics are traced both ways.",
}
"""What is not as in the paper with our learner, beside the learner; by a claim's id."""


def methods_with_ours(claim: str) -> dict[str, str]:
    """Methods that the claim with this id compares, and what takes their place with our learner."""
    return {**WITH_OURS, **_OF_CLAIMS.get(claim, {})}


def _with_ours(claim: Claim) -> Claim:
    """The same claim of our learner, as far as that has what is compared."""
    ours = methods_with_ours(claim.id)
    statement = claim.statement.replace("the Adam step", "the optimiser's step")
    if claim.id in _DIFFERENCES:
        statement = f"{statement} ({_DIFFERENCES[claim.id]})"
    return replace(
        claim,
        id=f"ours_{claim.id}",
        with_ours=True,
        title=f"{claim.title}, with our learner",
        statement=statement,
        comparisons=tuple(
            replace(comparison, better=ours[comparison.better], worse=ours[comparison.worse])
            for comparison in claim.comparisons
            if ours.keys() >= {comparison.better, comparison.worse}
        ),
    )


CLAIMS = (*_OF_THE_PAPER, *map(_with_ours, _OF_THE_PAPER))
"""All that the paper says is judged with its learner and with ours."""
