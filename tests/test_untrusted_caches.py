"""Caches and checkpoints are files that others may have written: reading one runs no code."""

from __future__ import annotations

import ast
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from ngi.evaluate.lpips_metric import _convolutions
from ngi.evaluate.references import read_reference
from ngi.learn import CostFile
from ngi.reuse.archive import _read_segment

SOURCES = Path(__file__).parents[1]


class Malicious:
    """Makes a file when it is unpickled."""

    def __init__(self, witness: Path) -> None:
        self._witness = witness

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return Path.touch, (self._witness,)


def as_torch(path: Path, content: Any) -> None:
    torch.save({"ids": content, "state": content, "0.weight": content}, path)


def as_pickle(path: Path, content: Any) -> None:
    path.write_bytes(pickle.dumps(content, protocol=2))  # the one that torch reads in silence


def as_numpy(path: Path, content: Any) -> None:
    array = np.array([content], dtype=object)
    names = ("key", "half_a", "half_b", "samples_per_pixel", "noise", "backend")
    with path.open("wb") as file:
        np.savez(file, **dict.fromkeys(names, array))


READERS: dict[str, Callable[[Path], object]] = {
    "reference": lambda path: read_reference(path, resolution=8),
    "patches": lambda path: _read_segment(path, 0),
    "LPIPS weights": _convolutions,
    "costs": lambda path: CostFile(path).missing([]),
}


@pytest.mark.parametrize("write", [as_torch, as_pickle, as_numpy])
@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_reading_runs_no_code(tmp_path, read, write) -> None:
    witness, path = tmp_path / "witness", tmp_path / "file"
    write(path, Malicious(witness))
    with pytest.raises(ValueError, match="file"):
        read(path)
    assert not witness.exists()


def test_the_malice_works(tmp_path) -> None:
    as_torch(tmp_path / "file", Malicious(tmp_path / "witness"))
    torch.load(tmp_path / "file", weights_only=False)
    assert (tmp_path / "witness").exists()


def test_nothing_else_unpickles() -> None:
    """What comes through a pipe from a process of our own aside."""
    pipes = {"worker_protocol.py", "worker_process.py"}
    for folder in ("ngi", "analysis"):
        for file in (SOURCES / folder).rglob("*.py"):
            for call in (n for n in ast.walk(ast.parse(file.read_text())) if type(n) is ast.Call):
                name, options = ast.unparse(call.func), [ast.unparse(k) for k in call.keywords]
                assert name not in ("pickle.load", "pickle.loads") or file.name in pipes, file
                assert name != "torch.load" or "weights_only=True" in options, file
                assert "allow_pickle=True" not in options, file
