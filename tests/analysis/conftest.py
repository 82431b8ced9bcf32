"""Run folders as training writes them, with made-up numbers."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

METRICS = ("mape", "dssim", "mae", "lpips")
SETS = ("hard", "uniform")
TYPICAL = {"mape": 0.2, "dssim": 0.04, "mae": 0.05, "lpips": 0.3}
PICTURE = 32

MakeRun = Callable[..., Path]


@pytest.fixture
def undrawn(monkeypatch) -> None:
    """Figures are files without a picture: drawing takes seconds, and some tests read texts."""

    def savefig(_figure, stream, *, format: str, dpi: float, **_) -> None:
        if format == "svg":
            stream.write(b'<svg xmlns="http://www.w3.org/2000/svg"/>')
        elif format == "pdf":
            stream.write(b"%PDF-1.4")  # Pillow's would have the time in it
        else:
            Image.new("RGB", (1, 1)).save(stream, format, dpi=(dpi, dpi))

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", savefig)


def final_error(set_name: str, metric: str, quality: float, seed: int) -> float:
    """Smaller for a higher quality, and a little different for every seed."""
    difficulty = {"hard": 1.5, "uniform": 1.0}[set_name]
    return difficulty * TYPICAL[metric] / quality * (1 + 0.1 * math.sin(7 * seed + quality))


def result_file(
    *, scene: str, sampler: str, seed: int, quality: float, label: dict[str, str], lpips: bool
) -> dict[str, Any]:
    metrics: dict[str, Any] = {}
    for set_name in SETS:
        metrics[set_name] = {}
        for metric in METRICS:
            mean = final_error(set_name, metric, quality, seed)
            metrics[set_name][metric] = {
                "mean": mean,
                "worst5": 2 * mean,
                "floor": 0.1 * TYPICAL[metric],
            }
        if not lpips:
            metrics[set_name]["lpips"] = None
    return {
        "schema_version": 1,
        "identity": f"{scene}{sampler}{seed}",
        "finished": True,
        "label": {
            "experiment": "demo",
            "scene": scene,
            "sampler": sampler,
            "reuse": "self_tuning",
            "resolution": "constant",
            "model": "pixel_generator",
            "loss": "l1_dssim",
            "budget": "seconds",
            "overrides": "default",
            "seed": seed,
            **label,
        },
        "seed": seed,
        "config": {},
        "commit": None,
        "dirty": False,
        "versions": {},
        "machine": {},
        "protocol": {"name": "demo", "identity": "0123456789abcdef"},
        "scene_hash": f"{scene}-files",
        "reference_hash": f"{scene}-references",
        "seconds": {"render": 100.0, "train": 120.0},
        "run_seconds": 240.0 + seed,
        "steps": 1000 + 10 * seed,
        "patches_traced": 16000,
        "paths_traced": 524288000,
        "metrics": metrics,
        "non_finite": {"hard": 0, "uniform": 0},
        "frames": [
            {
                "set": set_name,
                "index": index,
                **{m: final_error(set_name, m, quality ** (1 + index % 4), seed) for m in METRICS},
                "non_finite": 0,
            }
            for set_name in SETS
            for index in range(5)
        ],
        "lpips_note": None if lpips else "no AlexNet weights for LPIPS: save URL as FILE",
    }


def write_history(file: Path, *, steps: int, seed: int, quality: float, lpips: bool) -> None:
    with file.open("w", newline="") as stream:
        keys = [f"{s}_{m}{suffix}" for s in SETS for m in METRICS for suffix in ("", "_worst5")]
        writer = csv.DictWriter(stream, ["step", "run_seconds", "train_seconds", *keys])
        writer.writeheader()
        for step in range(9):
            row: dict[str, Any] = {"step": steps if step == 8 else 100 * step}
            row["run_seconds"] = 30.0 * step + seed
            row["train_seconds"] = 14.0 * step
            decay = 1 + 6 * math.exp(-step / 2)
            for set_name in SETS:
                for metric in METRICS:
                    value = decay * final_error(set_name, metric, quality, seed + 3 * step)
                    empty = metric == "lpips" and not lpips
                    row[f"{set_name}_{metric}"] = "" if empty else value
                    row[f"{set_name}_{metric}_worst5"] = "" if empty else 2 * value
            writer.writerow(row)


def write_pictures(folder: Path, *, quality: float) -> None:
    """A gradient with a disc; the prediction is noisier the worse the run is."""
    folder.mkdir()
    y, x = np.mgrid[-1 : 1 : PICTURE * 1j, -1 : 1 : PICTURE * 1j]
    for index in range(5):
        disc = (x - 0.2 * index + 0.4) ** 2 + y**2 < 0.2
        reference = np.stack([0.5 + 0.3 * x, 0.5 + 0.3 * y, np.where(disc, 0.9, 0.4)], axis=-1)
        noise = np.random.default_rng(index).normal(size=(PICTURE, PICTURE, 1))
        error = np.abs(noise) * 0.3 / quality
        images = {
            "reference": reference,
            "prediction": reference * (1 + noise * 0.3 / quality),
            "error": np.repeat(error, 3, axis=-1),
        }
        for kind, image in images.items():
            information = PngInfo()
            information.add_text("scale", "|d| / (reference + 0.01), mean of RGB")
            information.add_text("colour_map", "gray")
            information.add_text("maximum", "1")
            Image.fromarray((255 * image.clip(0, 1)).astype(np.uint8)).save(
                folder / f"hard_{index:02d}_{kind}.png", pnginfo=information
            )


def run_maker(root: Path) -> MakeRun:
    """What `make_run` is, for any folder."""

    def make(
        *,
        scene: str = "mirror",
        sampler: str = "uniform",
        seed: int = 0,
        quality: float = 1.0,
        lpips: bool = True,
        change: Callable[[dict[str, Any]], None] = lambda _: None,
        **label: str,
    ) -> Path:
        name = "_".join([sampler, *label.values()])
        folder = root / scene / name / f"seed={seed}"
        folder.mkdir(parents=True)
        result = result_file(
            scene=scene, sampler=sampler, seed=seed, quality=quality, label=label, lpips=lpips
        )
        change(result)
        (folder / "settings.json").write_text("{}")
        (folder / "result.json").write_text(json.dumps(result))
        write_history(
            folder / "metrics.csv", steps=result["steps"], seed=seed, quality=quality, lpips=lpips
        )
        write_pictures(folder / "pictures", quality=quality)
        return folder

    return make


@pytest.fixture
def make_run(tmp_path: Path) -> MakeRun:
    """Writes one run folder below tmp_path / 'runs'; `change` edits the result before that."""
    return run_maker(tmp_path / "runs")


def method_maker(make_run: MakeRun) -> MakeRun:
    """What `make_method` is, for any `make_run`.

    error: the geometric mean over seeds and frames, for every metric; spread: standard deviation
    of the logarithm of a factor of its own for every seed and frame; what all methods share (a
    factor per frame and one per seed) cancels in pairs. The curve falls from 8 times the final
    error, exponentially, with `rate` per second.
    """

    def make(
        method: str,
        *,
        scene: str = "living-room",
        seed: int = 0,
        error: float = 0.1,
        spread: float = 0.02,
        rate: float = 0.01,
        change: Callable[[dict[str, Any]], None] = lambda _: None,
        **label: str,
    ) -> Path:
        own = np.random.default_rng([seed, *method.encode(), *scene.encode()])
        shared = np.random.default_rng(seed).normal(scale=0.3, size=6)

        def set_errors(result: dict[str, Any]) -> None:
            for frame in result["frames"]:
                factor = math.exp(shared[frame["index"]] + shared[5] + spread * own.normal())
                frame.update(dict.fromkeys(METRICS, error * factor))
            change(result)

        folder = make_run(
            scene=scene,
            sampler=f"of {method}",
            seed=seed,
            change=set_errors,
            method=method,
            **label,
        )
        steps = json.loads((folder / "result.json").read_text())["steps"]
        keys = [f"{s}_{m}{suffix}" for s in SETS for m in METRICS for suffix in ("", "_worst5")]
        with (folder / "metrics.csv").open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(["step", "run_seconds", *keys])
            for step in range(9):
                value = error * (1 + 7 * math.exp(-rate * 30 * step))
                number = steps if step == 8 else 100 * step
                writer.writerow([number, 30.0 * step, *[value] * len(keys)])
        return folder

    return make


@pytest.fixture
def make_method(make_run: MakeRun) -> MakeRun:
    """Writes a run of an option of the group `method` whose errors on every frame are known."""
    return method_maker(make_run)


@pytest.fixture(scope="session")
def makers_below() -> Callable[[Path], tuple[MakeRun, MakeRun]]:
    """`make_run` and `make_method` below a folder, for what several tests share."""

    def makers(root: Path) -> tuple[MakeRun, MakeRun]:
        make_run = run_maker(root)
        return make_run, method_maker(make_run)

    return makers
