"""Names methods by what tells them apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from analysis.runs import DISTINCTIONS, Run

BASELINE = "uniform"
"""The method (and sampler) that others are compared with; it comes first."""

OF_SAMPLER = "sampler="
"""What begins the override, and the part of a name, that says which sampler a method was given."""

TITLES = {
    "uniform": "uniform sampling",
    "active_exploration": "Active Exploration",
    "metropolis": "Metropolis acceptance",
    "loss_target": "the loss alone as target",
    "output_gradient_target": "loss × output gradient as target",
    "no_preconditioning": "no position preconditioning",
    "constant_resolution": "exploration at constant resolution",
    "uniform_growing": "uniform sampling with growing resolution",
    "traced_specular": "traced specular bounces",
    "traced_direct": "traced direct light",
    "ours_uniform": "ours with uniform sampling",
    "ours": "ours",
    "ours_predicted": "ours with more states of high predicted loss",
    "ours_eager": "ours after what is rare, by predicted loss",
    "ours_predicted_from_buffers": "ours with patches chosen by their buffers",
    "ours_supersampled": "ours with supersampled edges",
    "ours_small_patches": "ours with smaller patches of more configurations",
    "ours_exploring": "ours exploring, with Active Exploration's chains",
    "ours_loss_target": "ours exploring, with the loss alone as target",
    "ours_metropolis": "ours exploring, with Metropolis acceptance",
    "ours_exploring_growing": "ours exploring, with growing resolution",
    "ours_uniform_growing": "ours with uniform sampling and growing resolution",
    "ours_learned_specular": "ours exploring, with learnt specular bounces",
    "ours_paper_network": "ours exploring, with the paper's network",
    "ours_no_preconditioning": "ours exploring, with the paper's network, no preconditioning",
    "sobol": "a Sobol sequence",
    "latin_hypercube": "Latin hypercubes",
    "fixed_data": "a fixed data set",
    "prioritised_replay": "prioritised replay",
    "cnsr": "CNSR",
    "anf": "path tracing + ANF, 8 spp",
    "path_tracing": "path tracing, same time per frame",
    "path_tracing_oidn": "path tracing + Open Image Denoise, same time per frame",
    "path_tracing_optix": "path tracing + OptiX denoiser, same time per frame",
    "path_tracing_8spp": "path tracing, 8 spp",
    "path_tracing_oidn_8spp": "path tracing + Open Image Denoise, 8 spp",
    "path_tracing_optix_8spp": "path tracing + OptiX denoiser, 8 spp",
}
"""What tables and pictures call the options of the configuration group `method`, in order."""


def name_methods(runs: Sequence[Run]) -> list[Run]:
    """The same runs with `method` set: what was chosen, and what else their methods differ by.

    What was chosen is the option of the group `method`, or without one the sampler, and the sampler
    that a method was given in place of its own: 'ours, sampler=uniform'. 'uniform' and 'mcmc_loss'
    suffice where each was run in one way. Otherwise the fewest label fields that tell its runs
    apart follow: 'mcmc_loss, growing'.
    """
    named = []
    for run in runs:
        alike = [other for other in runs if _chosen(other) == _chosen(run)]
        fields = _telling_fields(alike)
        parts = [_chosen(run), *(_value(run, field, alike) for field in fields)]
        named.append(replace(run, method=", ".join(part for part in parts if part)))
    return named


def _chosen(run: Run) -> str:
    method = run.label.get("method")
    if not method:
        return run.label["sampler"]
    given = [word for word in run.label["overrides"].split(",") if word.startswith(OF_SAMPLER)]
    return ", ".join([method, *given])


def methods_in_order(runs: Sequence[Run]) -> list[str]:
    """The methods' names: the baseline's first, then in the order of `TITLES`, then by name."""
    known = list(TITLES)

    def position(name: str) -> tuple[bool, int, str]:
        base = name.split(", ")[0]
        return not is_baseline(name), known.index(base) if base in known else len(known), name

    return sorted({run.method for run in runs}, key=position)


def is_baseline(method: str, *, baseline: str = BASELINE) -> bool:
    """baseline: a method's name, what all names of its variants begin with, or a sampler that a
    method was given in place of its own
    """
    base, *rest = method.split(", ")
    return baseline in (method, base) or f"{OF_SAMPLER}{baseline}" in rest


def baselines(budgets: Mapping[str, object], *, baseline: str = BASELINE) -> list[tuple[str, str]]:
    """Every other method beside its baseline: the one that is asked for where that was run, else
    the first.

    budgets: by method, in order; each method has the baseline of its own budget, where there is one
    """
    asked_for = [method for method in budgets if is_baseline(method, baseline=baseline)]
    found = []
    for method, budget in budgets.items():
        alike = [other for other in budgets if budgets[other] == budget]
        own = [other for other in alike if other in asked_for]
        found.append((method, (own or asked_for or alike)[0]))
    return [(method, baseline) for method, baseline in found if method != baseline]


def title(method: str) -> str:
    """A method's name for readers: 'Active Exploration, never' for 'active_exploration, never'."""
    base, *rest = method.split(", ")
    return ", ".join([TITLES.get(base, base), *rest])


def _telling_fields(runs: Sequence[Run]) -> list[str]:
    """The first of `DISTINCTIONS` that split these runs as finely as all of them together do."""
    by_scene: dict[str, list[Run]] = {}
    for run in runs:
        by_scene.setdefault(run.scene, []).append(run)

    def groups(fields: Sequence[str]) -> int:
        return sum(
            len({tuple(run.label[field] for field in fields) for run in of_scene})
            for of_scene in by_scene.values()
        )

    chosen: list[str] = []
    for field in DISTINCTIONS:
        if groups([*chosen, field]) > groups(chosen):
            chosen.append(field)
    return chosen


def _value(run: Run, field: str, others: Sequence[Run]) -> str:
    """A label field's value; of the overrides only those that not all the runs have."""
    if field != "overrides":
        return run.label[field]
    common = set.intersection(*(set(other.label[field].split(",")) for other in others))
    return " ".join(item for item in run.label[field].split(",") if item not in common)


def differing_fields(runs: Sequence[Run]) -> list[str]:
    """Label fields that are not the same in all runs of a scene, the sampler first."""
    first = {run.scene: run for run in reversed(runs)}
    return [
        field
        for field in ("sampler", *DISTINCTIONS)
        if any(run.label[field] != first[run.scene].label[field] for run in runs)
    ]
