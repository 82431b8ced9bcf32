"""SIGKILL at any time loses nothing: the same command ends as if nothing had happened."""

import itertools
import os
import random
import time
from collections import Counter
from multiprocessing.context import ForkServerProcess
from pathlib import Path

import pytest

from tests.learn.comparison import assert_same_run
from tests.learn.forked import configuration, run, start

LEARNER = (
    "optimizer=muon",
    "schedule=warmup_stable_decay",
    "schedule.warmup_steps=5",
    "averaging=exponential",
)
"""Everything of ours about learning that the paper does not have."""
SHORT = ("budget.steps=24", "run.checkpoint_steps=5")
"""Every kill costs a part of a run."""
AIMED_AT = {"writing": 0.3, "at the end": 0.15}
"""Shares of the kills that wait for such a moment, however short it is; others wait for nothing."""


def killed(process: ForkServerProcess, folder: Path, *, after: float, aim: str | None) -> bool:
    """Kills it after some seconds, at the next `moment` aimed at; False where it ended before."""
    process.join(timeout=after)
    while process.is_alive() and not (aim is None or at(folder, aim)):
        time.sleep(0.0005)
    process.kill()
    process.join()
    assert process.exitcode in (0, -9), process.exitcode
    return process.exitcode != 0


@pytest.mark.parametrize(("kills", "overrides"), [(50, SHORT), (25, (*SHORT, *LEARNER))])
def test_runs_killed_at_many_moments_end_bit_for_bit_like_an_unbroken_one(
    tmp_path: Path, kills: int, overrides: tuple[str, ...]
) -> None:
    unbroken = tmp_path / "unbroken"
    unbroken.mkdir()
    run(
        configuration(unbroken, *overrides), tmp_path / "first"
    )  # the first process waits for the imports
    (unbroken / "run").rename(unbroken / "first")
    since = time.monotonic()
    assert run(configuration(unbroken, *overrides), tmp_path / "second")[0] == 0
    life = time.monotonic() - since
    assert_same_run(unbroken / "run", unbroken / "first")

    generator, shares = random.Random(5), AIMED_AT.values()
    moments: Counter[str] = Counter()
    for folder in (tmp_path / f"run{number}" for number in itertools.count()):
        folder.mkdir()
        shared = unbroken / "references" if generator.random() < 0.5 else None
        config = configuration(folder, *overrides, references=shared)
        while moments.total() < kills and killed(
            start(config, folder / "output"),
            folder,
            after=generator.uniform(0, life),
            aim=generator.choices([*AIMED_AT, None], [*shares, 1 - sum(shares)])[0],
        ):
            moments[moment(folder)] += 1
        if moments.total() == kills:
            break
        assert_same_run(folder / "run", unbroken / "run")
    status, output = run(config, folder / "output")
    assert status == 0, output
    assert_same_run(folder / "run", unbroken / "run")
    expected = {"before training", "training", "writing", "at the end"}
    assert kills < 50 or moments.keys() == expected, moments


def at(folder: Path, aim: str) -> bool:
    """Whether a run is at this moment: asked often, while the run wants the processor too."""
    if aim == "at the end" and not (folder / "run" / "pictures").exists():
        return False
    return moment(folder) == aim


def moment(folder: Path) -> str:
    """What a run is about, or was when it was killed."""
    if any(name.endswith(".partial") for _, _, names in os.walk(folder) for name in names):
        return "writing"
    if (folder / "run" / "pictures").exists():
        return "at the end"
    return "training" if (folder / "run" / "last.ckpt").exists() else "before training"
