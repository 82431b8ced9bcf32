"""Metrics of a finished run, from its linear pictures, beside those of its result.json."""

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from tabulate import tabulate
from tqdm import tqdm

from ngi.evaluate import METRICS, SETS, EvaluationProtocol, Lpips
from ngi.evaluate.evaluation import mean, worst_mean
from ngi.evaluate.linear import read_linear
from ngi.evaluate.metrics import image_metrics, non_finite_pixels
from ngi.files.durable import damage_named

TOLERANCES = {"float": (1e-6, 1e-9), "half": (1e-2, 1e-3)}
"""Relative and absolute, by the format of the pictures; LPIPS has those of half floats in any case,
since its network computes in 32 bits. The other metrics of the same 32-bit pictures are the same
but for the order in which another machine adds numbers."""

Frames = list[dict[str, Any]]
"""Of each: 'set', 'index', the metrics and 'non_finite', as in result.json."""


def recomputed(run: Path, result: Mapping[str, Any], *, lpips: Lpips) -> Frames:
    """The metrics of a run's test frames, from its linear pictures; LPIPS where it is available.

    Raises ValueError where the run has no such pictures, where one cannot be read, and where this
    program measures by another protocol.
    """
    if "frames" not in result and "metrics" in result:
        raise ValueError(f"{run} holds only the network of a run, without its pictures")
    if result.get("linear") is None:
        raise ValueError(
            f"{run} has no linear pictures: run.linear_megabytes was too small, or an older "
            "version, which did not keep them, made the run"
        )
    protocol = _protocol(run, result)
    frames = []
    for frame in tqdm(result["frames"], desc=run.parent.name, unit="frame", disable=None):
        prediction, reference = read_linear(run / "linear", frame["set"], frame["index"])
        frames.append(
            {
                "set": frame["set"],
                "index": frame["index"],
                "non_finite": non_finite_pixels(prediction),
                **image_metrics(prediction, reference, protocol=protocol, lpips=lpips),
            }
        )
    return frames


def _protocol(run: Path, result: Mapping[str, Any]) -> EvaluationProtocol:
    settings = result["config"]["evaluation"]["evaluator"]["protocol"]
    told, known = result["protocol"]["identity"], "no protocol"
    with suppress(TypeError):  # it has others keys
        protocol = EvaluationProtocol(
            **{key: value for key, value in settings.items() if not key.startswith("_")}
        )
        if (known := protocol.identity) == told:
            return protocol
    raise ValueError(
        f"{run} was measured with protocol {told}; in this version of the program the same "
        f"settings give {known}; use the version that made the run ({result.get('commit')})"
    )


def differences(result: Mapping[str, Any], frames: Frames) -> Iterator[str]:
    """What of result.json is not what its linear pictures give, a line each."""
    for told, found in zip(result["frames"], frames, strict=True):
        for name in (*METRICS, "non_finite"):
            if not _same(name, told[name], found[name], result["linear"]):
                where = f"{told['set']} frame {told['index']}"
                yield f"{where}: {name} is {told[name]} in result.json, recomputed {found[name]}"
    for set_name in SETS:
        for name in METRICS:
            summary = result["metrics"][set_name][name]
            values = [f[name] for f in result["frames"] if f["set"] == set_name]
            if summary is None or None in values:
                continue
            for statistic, value in (("mean", mean(values)), ("worst5", worst_mean(values))):
                if not _same(name, summary[statistic], value, "float"):
                    yield (
                        f"{set_name}: {name}'s {statistic} is {summary[statistic]} in result.json, "
                        f"that of its frames is {value}"
                    )


def _same(name: str, told: float | None, found: float | None, kept: str) -> bool:
    """True, too, where one of the two was not measured."""
    if told is None or found is None:
        return True
    if name == "non_finite":  # EXR keeps NaN and Inf as they are
        return told == found
    relative, absolute = TOLERANCES["half" if name == "lpips" else kept]
    both_nan = math.isnan(told) and math.isnan(found)
    return both_nan or math.isclose(told, found, rel_tol=relative, abs_tol=absolute)


def table(result: Mapping[str, Any], frames: Frames) -> str:
    """Means over each set of frames, as result.json has them and as `recomputed` does."""
    rows = []
    for set_name in SETS:
        for name in METRICS:
            told = result["metrics"][set_name][name]
            values = [f[name] for f in frames if f["set"] == set_name]
            found = None if None in values else mean(values)
            rows.append([set_name, name, None if told is None else told["mean"], found])
    headers = ["frames", "metric", "result.json", "recomputed"]
    table: str = tabulate(rows, headers, floatfmt=".6g", missingval="–")
    return table


def read_result(file: Path) -> dict[str, Any]:
    """The content of a result.json; ValueError where it is damaged."""
    with damage_named(file):
        result: dict[str, Any] = json.loads(file.read_text())
    return result
