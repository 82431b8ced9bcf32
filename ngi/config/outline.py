"""Lines that say what a run trains, so that what followed from budget and machine is seen."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from ngi.machine.size import usable_cores


def outline(config: Mapping[str, Any], *, device: str) -> str:
    """Method, time, machine, network, patches and reuse of a run, in one line.

    config: of a run that trains a network, resolved, with its label
    device: that it trains on
    """
    value = partial(_value, config)
    steps, seconds = value("budget.steps"), value("budget.seconds")
    layers, features = value("model.hidden_layers"), value("model.hidden_features")
    side, chains = value("renderer.patch_size"), value("sampler.chains")
    samples = value("renderer.samples_per_pixel")
    bootstrap = value("reuse.policy.bootstrap_batches")
    limits = [f"{steps} steps"] if steps is not None else []
    if seconds is not None:
        limits.append(f"{seconds:g} s")
    gpu = "a GPU and " if device == "cuda" else ""
    machine = f"{gpu}{usable_cores()} cores ({value('trainer.precision')})"
    parts = [
        value("label.method") or value("label.sampler"),
        f"{' or '.join(limits)} on {machine}",
        f"{value('label.model')} of {layers} x {features} features",
        f"{chains} patches of {side} x {side} pixels a step",
        f"{'as many as the scene says' if samples is None else samples} samples per pixel",
        f"images of {value('resolution.start')} pixels",
    ]
    if bootstrap is not None:
        parts.append(f"{bootstrap} new batches before the first is reused")
    return "; ".join(parts)


def only_bootstrap(config: Mapping[str, Any], *, steps: int, generated_batches: int) -> str | None:
    """What to do about a run that has ended within its bootstrap; None where it has not.

    steps: that the run has taken
    generated_batches: how many of them were on new patches
    """
    bootstrap = _value(config, "reuse.policy.bootstrap_batches") or 0
    if not steps == generated_batches < bootstrap:
        return None
    return (
        f"each of the {steps} steps waited for new patches, because reuse.policy.bootstrap_batches="
        f"{bootstrap} comes before any reuse: give the run more time, lower that number, or name "
        "neither budget nor method, so that both follow from budget.seconds and this machine"
    )


def _value(config: Mapping[str, Any], key: str) -> Any:
    """None where a run has no such key."""
    value: Any = config
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    return value
