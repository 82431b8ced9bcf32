"""Writes a run's logs as training does, with made-up numbers."""

import hashlib
import json
from pathlib import Path

import numpy as np

from ngi.files.record_log import RecordLog

CHAINS = 16


def write_trace(folder: Path, position: np.ndarray, accepted: np.ndarray, **other: object) -> None:
    """position: [T, n, S]; accepted: [T, n]; `other` fields are [T, n] too. Steps are 1, 2, …"""
    log = RecordLog(folder / "chains.bin", description="")
    later = np.arange(len(accepted))[:, None] + np.zeros_like(accepted) > 0
    fields = {
        "position": position.astype(np.float32),
        "large_step": np.ones_like(accepted),
        "accepted": accepted,
        "initialised": ~later,
        "target_proposed": np.full(accepted.shape, np.nan, np.float32),
        "target_current": np.full(accepted.shape, np.nan, np.float32),
        **other,
    }
    for index in range(len(accepted)):
        log.append({"step": index + 1, **{name: field[index] for name, field in fields.items()}})
    log.close()


def write_maps(folder: Path, target: np.ndarray, steps: list[int], *, patches: int = 16) -> None:
    """target: [g, g], of every evaluation; the patch position x multiplies it by 2 x."""
    cells = len(target)
    generator = np.random.default_rng(3)
    state = generator.random((cells, cells, patches, 4))
    # Evenly in every cell, so that its mean is `target`.
    state[..., 2] = (
        generator.permuted(np.arange(patches) + np.zeros_like(state[..., 2]), axis=-1) + 0.5
    ) / patches
    index = np.arange(cells)
    state[..., :2] = (
        state[..., :2] + np.stack(np.meshgrid(index, index, indexing="ij"), -1)[:, :, None]
    ) / cells
    values = (2 * target[..., None] * state[..., 2]).astype(np.float32)
    log = RecordLog(folder / "target_map.bin", description="")
    for step in steps:
        record = {"state": state.astype(np.float32), "loss": values, "target": values}
        log.append({"step": step, "run_seconds": 2.0 * step, **record})
    log.close()


def write_steps(folder: Path, count: int) -> None:
    names = ("reuse_probability", "loss_new", "loss_existing", "store_size", "store_mean_age")
    rates = ("large_step_acceptance_rate", "small_step_acceptance_rate")
    lines = [",".join(["step", "run_seconds", *names, *rates])]
    lines += [f"{s},{2.0 * s},0.5,{1 / s},{2 / s},{16 * s},{s / 2},0.25," for s in range(1, count)]
    (folder / "steps.csv").write_text("\n".join(lines) + "\n")


def write_logs(folder: Path) -> None:
    """Logs of a run of ten steps, in the result file as training records them."""
    position = np.random.default_rng(0).random((10, 4, 3))
    target = np.ones((10, 4), np.float32)
    write_trace(folder, position, np.ones((10, 4), bool), target_proposed=target)
    write_steps(folder, 10)
    file = folder / "result.json"
    result = json.loads(file.read_text())
    result["logs"] = {
        name: {
            "bytes": len(content := (folder / name).read_bytes()),
            "sha256": hashlib.sha256(content).hexdigest(),
        }
        for name in ("metrics.csv", "steps.csv", "chains.bin")
    }
    file.write_text(json.dumps(result))
