"""What the steps of a run cost, component by component, and the file that keeps these costs.

A run's steps are of three kinds: on stored patches, on newly generated ones, and on generated ones
for which the chains' current states are scored too. What they cost is put together from

- training: any step, at the price of one on stored patches (phases reuse, train, other);
- exploring: what a generated step takes more for proposing, accepting and storing (explore, reuse),
  and for telling its losses' noise from two halves (score);
- rendering: the patches of a generated step (render);
- scoring: all that a scored step takes more than one that is not (score).

A component is known by the settings that it depends on and by nothing else, and it is measured once
(`ngi.studies.step_costs`). What two methods share has therefore the same cost in both, and noise
of the measurement cannot decide between them. What is not told apart: where in the scene the chains
are, the resolution that patches are cut from (64 to 600 pixels: within 4 % of 128 on two scenes),
and how full the store is. The seconds are medians: what fewer than half of the batches do, such as
growing the forest of `PredictedLoss` anew, is not counted.
"""

import fcntl
import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from ngi.files.durable import damage_named, write_atomically
from ngi.render.protocol import Renderer

Costs = dict[str, dict[str, float]]
"""Component -> phase -> seconds per step that the component belongs to."""

COSTING_NO_STEP = ("supersampled_edges", "centred")
"""What of the samples' settings concerns images alone, or where patches are."""

NOT_AVERAGED = "ngi.models.no_average"
"""What conf/averaging/none.yaml names."""

SCALAR = "scalar_rgb"
"""Mitsuba's slow variant, as renderers describe themselves."""

REMEDY = "measure it with the same command line, but `ngi costs` instead of `ngi train`"


@dataclass(frozen=True)
class Component:
    """Something that steps spend time on.

    settings: all that this time depends on, as plain JSON data
    """

    name: str
    settings: dict[str, Any]

    @property
    def key(self) -> str:
        """Name and hash of the settings."""
        canonical = json.dumps(self.settings, sort_keys=True)
        return f"{self.name}-{hashlib.sha256(canonical.encode()).hexdigest()[:12]}"


def components(
    settings: Mapping[str, Any], *, renderer: Renderer, scored: bool, patches_per_vector: int
) -> list[Component]:
    """Of a run with this resolved configuration, as plain data.

    scored: whether its sampler looks at the targets of the chains' current states
    patches_per_vector: how many patches its sampler draws of one scene, which is set up for all
    """
    sampler = settings["sampler"]
    samples = _samples(settings["data"], renderer)
    patches = {
        "patches": sampler["chains"],
        "patch_size": renderer.patch_size,
        "buffers": list(renderer.layout.names),
        "dimensions": renderer.dimensions,
        **samples,
        **_gpu(),
    }
    training = {
        "model": _costing_the_same(settings["model"]),
        **{part: settings[part] for part in ("loss", "trainer")},
        "optimizer": _without(settings["optimizer"], "lr", "adam_lr"),
        **_averaging(settings),
        **_inputs(settings, renderer),
        **patches,
    }
    rendering = {
        **_without(settings["renderer"], "scene", "workers", "cluster", "halves"),
        "samples_per_pixel": renderer.samples_per_pixel,
        "scene": {"name": settings["scene"]["name"], "hash": renderer.scene_hash},
        "patches": sampler["chains"],
        **samples,
        **_gpu(),
        **_without_llvm(renderer),
    }
    if patches_per_vector > 1:  # else nothing: what is measured already stays what it is called
        rendering["patches_per_vector"] = patches_per_vector
    noise = {"loss": settings["loss"]} if renderer.halves else {}
    found = [
        Component("training", training),
        Component("exploring", {**_proposing(sampler), **patches, **noise}),
        Component("rendering", rendering),
    ]
    if scored:
        found.append(Component("scoring", {"target": sampler["target"], **training}))
    return found


def _samples(data: Mapping[str, Any], renderer: Renderer) -> dict[str, Any]:
    """What is rendered for a sample, and what is made of it."""
    samples = {
        key: value
        for key, value in data.items()
        if not key.startswith("_") and key not in COSTING_NO_STEP
    }
    # Else nothing, so that what is measured already stays what it is called.
    if renderer.halves:
        samples["halves"] = True
    if not _shipped(data):
        samples["samples"] = data["_target_"]
    return samples


def _costing_the_same(model: Mapping[str, Any]) -> dict[str, Any]:
    """A network's settings, under the name that its costs had before emission was radiance."""
    same = {"ngi.models.LinearEmissionGenerator": "ngi.models.EncodedGenerator"}
    return {**model, "_target_": same.get(model["_target_"], model["_target_"])}


def _proposing(sampler: Mapping[str, Any]) -> dict[str, Any]:
    """Of chains the kind of proposal, of a sampler without chains all it is made of. Classes of
    one's own count with all their settings, and so does one that accepts.
    """
    if "proposal" in sampler and _shipped(sampler):
        parts = {name: sampler[name] for name in ("proposal", "acceptance") if name in sampler}
        own = {name: part for name, part in parts.items() if not _shipped(part)}
        return {"proposal": sampler["proposal"]["_target_"]} | own
    return {"sampler": _without(sampler, "chains")}


def _shipped(part: Mapping[str, Any]) -> bool:
    """Whether its class is one of this program's, and not of one's own."""
    return str(part["_target_"]).startswith("ngi.")


def _inputs(settings: Mapping[str, Any], renderer: Renderer) -> dict[str, int]:
    """What a network is given beside buffers and v, and what of v it is not given; nothing where
    there is neither: what is measured already stays what it is called.
    """
    found = {}
    if settings["model"].get("relative") and (points := len(renderer.moving_points.offset)):
        found["moving_points"] = points
    camera = renderer.camera_part
    if settings["data"].get("camera") is False and (left_out := camera.stop - camera.start):
        found["left_out"] = left_out
    return found


def _averaging(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Nothing without an average: what is measured already stays what it is called."""
    averaging = _without(settings["averaging"], "decay")
    return {} if averaging["_target_"] == NOT_AVERAGED else {"averaging": averaging}


def _gpu() -> dict[str, str]:
    """What 'auto' means for network and renderer: costs with a GPU are not those without."""
    return {"gpu": torch.cuda.get_device_name()} if torch.cuda.is_available() else {}


def _without_llvm(renderer: Renderer) -> dict[str, str]:
    """What 'auto' means where neither GPU nor LLVM can be used; nothing where one of them can."""
    return {"variant": SCALAR} if SCALAR in renderer.description else {}


def _without(settings: Mapping[str, Any], *keys: str) -> dict[str, Any]:
    return {key: value for key, value in settings.items() if key not in keys}


class CostFile:
    """A JSON file of measured components, which several processes may read and add to.

    It can be read, and edited, by hand: seconds are those that count, quartiles and samples say how
    well they are known. Methods raise ValueError for a file that is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def costs(self, wanted: Iterable[Component]) -> Costs:
        """The costs of these components.

        Raises ValueError, with what to do, where one is missing and where they were measured on
        different processors or numbers of cores: the time of a step would be no machine's.
        """
        entries = self._entries()
        found: Costs = {}
        machines = {}
        for component in wanted:
            if component.key not in entries:
                about = component.settings.get("scene", component.settings.get("model", {}))
                raise ValueError(
                    f"budget.costs: {self.path} lacks '{component.key}' ({about}), which "
                    f"budget.clock=model needs; {REMEDY}"
                )
            found[component.name] = dict(entries[component.key]["seconds"])
            machine = entries[component.key].get("machine", {})
            machines[component.key] = f"{machine.get('cores')} cores of {machine.get('processor')}"
        if len(set(machines.values())) > 1:
            raise ValueError(
                f"budget.costs: the costs in {self.path} were measured on different machines: "
                f"{machines}; name a new file, and {REMEDY}"
            )
        return found

    def missing(self, wanted: Iterable[Component]) -> list[Component]:
        """Those of the components that are not measured yet."""
        entries = self._entries()
        return [component for component in wanted if component.key not in entries]

    def add(
        self,
        component: Component,
        seconds: Mapping[str, Sequence[float]],
        *,
        measured_by: Mapping[str, Any],
    ) -> None:
        """Keeps the medians of what was measured, phase by phase.

        measured_by: commit and machine. A component that another process added meanwhile stays as
        it is: runs may have begun with it.
        """
        quartiles = {
            phase: [float(q) for q in np.quantile(values, (0.25, 0.5, 0.75))]
            for phase, values in seconds.items()
        }
        entry = {
            "component": component.name,
            "seconds": {phase: median for phase, (_, median, _) in quartiles.items()},
            "quartiles": {phase: [lower, upper] for phase, (lower, _, upper) in quartiles.items()},
            "samples": max(map(len, seconds.values())),
            "settings": component.settings,
            **measured_by,
        }
        with self._locked():
            entries = {component.key: entry, **self._entries()}
            content = {"components": dict(sorted(entries.items()))}
            write_atomically(self.path, json.dumps(content, indent=2).encode())

    @contextmanager
    def _locked(self) -> Iterator[None]:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.with_name(self.path.name + ".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield

    def _entries(self) -> dict[str, Any]:
        if not self.path.exists():
            return {}
        advice = "budget.costs: correct it, or delete it and measure again with `ngi costs`"
        with damage_named(self.path, advice):
            entries: dict[str, Any] = json.loads(self.path.read_text())["components"]
            for key, entry in entries.items():
                for phase, seconds in entry["seconds"].items():
                    if not (math.isfinite(seconds) and seconds >= 0):
                        raise ValueError(f"{key}.seconds.{phase}: {seconds}")
        return entries
