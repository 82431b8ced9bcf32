"""A run that is trained longer is the longer run; where it would not be, it is refused."""

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest
from omegaconf import DictConfig

from ngi.learn import RunFolder
from ngi.train import train
from tests.learn.comparison import assert_same, final_state
from tests.learn.forked import configuration
from tests.learn.lightning_warnings import IGNORED, RESUMED
from tests.learn.test_checkpoint import segments

pytestmark = [*IGNORED, RESUMED]

WSD = ("schedule=warmup_stable_decay", "schedule.warmup_steps=3", "schedule.decay_share=0.5")
FORGETFUL = "reuse.store.capacity=12"
"""What the checkpoint before the decay needs is forgotten by the end of the run."""
STORED_ALONE = (
    *("reuse.policy._target_=ngi.reuse.FixedProbability", "+reuse.policy.probability=0.6"),
    *("~reuse.policy.beta", "~reuse.policy.ema_coefficient", "+reuse.policy.stored_alone=0.4"),
)
LEARNERS = {
    "the paper's": ("run.checkpoint_steps=9",),
    "decay": (*WSD, FORGETFUL),
    "decay, muon, averages": (*WSD, "optimizer=muon", "averaging=exponential"),
    "decay, bf16": (*WSD, "optimizer=muon", "trainer=bf16"),
    "decay, before it stored patches alone": (*WSD, "schedule.decay_share=0.2", *STORED_ALONE),
    "stored patches alone at last": STORED_ALONE,
}


def run(folder: Path, steps: int, *overrides: str) -> DictConfig:
    """Of so many steps, in `folder`/run; runs of the same test share their references."""
    config = configuration(
        folder, *overrides, "evaluation.count=2", references=folder.parent / "references"
    )
    config.budget.steps = steps
    return config


@pytest.mark.parametrize("learner", LEARNERS)
def test_in_the_end_it_is_the_longer_run_bit_for_bit(tmp_path: Path, learner: str) -> None:
    overrides = LEARNERS[learner]
    train(run(tmp_path / "at once", 60, *overrides))
    shorter = train(run(tmp_path / "longer", 44, *overrides))
    longer = train(run(tmp_path / "longer", 60, *overrides))
    assert (shorter["steps"], longer["steps"]) == (44, 60)
    ours, theirs = (tmp_path / name / "run" for name in ("longer", "at once"))
    assert_same(final_state(ours), final_state(theirs))
    assert (ours / "chains.bin").read_bytes() == (theirs / "chains.bin").read_bytes()
    steps = [pd.read_csv(f / "steps.csv").drop(columns="run_seconds") for f in (ours, theirs)]
    pd.testing.assert_frame_equal(*steps, check_exact=True)
    assert json.loads((ours / "settings.json").read_text())["budget"]["steps"] == 60
    evaluated = pd.read_csv(ours / "metrics.csv")["step"].tolist()
    expected = [22, 44, 60] if learner == "the paper's" else [22, 30, 60]
    assert evaluated == expected


def test_an_interrupted_run_can_be_lengthened_again_and_again(tmp_path: Path) -> None:
    train(run(tmp_path / "at once", 50, *WSD, FORGETFUL))
    ours = tmp_path / "longer"
    for steps, at in ((20, 15), (30, 18), (40, 39), (50, None)):
        config = run(ours, steps, *WSD, FORGETFUL, "run.checkpoint_steps=3")
        if at is None:
            train(config)
        else:
            stop(config, at)
    assert_same(final_state(ours / "run"), final_state(tmp_path / "at once" / "run"))


def test_a_run_that_is_broken_off_before_it_is_longer_is_unfinished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not finished with half of its logs, and either length goes on from it."""
    first = train(run(tmp_path / "longer", 40, *WSD))
    with monkeypatch.context() as patch:
        patch.setattr(RunFolder, "begin", interrupted)
        with pytest.raises(KeyboardInterrupt):
            train(run(tmp_path / "longer", 60, *WSD))
    assert not (tmp_path / "longer" / "run" / "result.json").exists()
    again = train(run(tmp_path / "longer", 40, *WSD))
    assert (again["steps"], again["metrics"]) == (40, first["metrics"])


def test_without_a_checkpoint_it_stays_as_it_is(tmp_path: Path) -> None:
    """As a copy of results alone."""
    train(run(tmp_path, 40, *WSD))
    folder = tmp_path / "run"
    for checkpoint in folder.glob("*.ckpt"):
        checkpoint.unlink()
    before = {file: file.read_bytes() for file in folder.glob("*.*") if file.name != ".lock"}
    with pytest.raises(ValueError, match=r"no checkpoint in it; restore last\.ckpt .*, or choose"):
        train(run(tmp_path, 60, *WSD))
    assert {file: file.read_bytes() for file in before} == before
    assert (folder / "result.json") in before


def interrupted(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


def stop(config: DictConfig, step: int) -> None:
    """Lets the run break off at this step."""
    from ngi.learn import TrainingStream

    with pytest.MonkeyPatch.context() as patch:
        log_row = TrainingStream.log_row

        def failing(stream: TrainingStream) -> dict:
            if stream.counters.iteration == step:
                raise RuntimeError("power cut")
            return log_row(stream)

        patch.setattr(TrainingStream, "log_row", failing)
        with pytest.raises(RuntimeError, match="power cut"):
            train(config)


@pytest.fixture(scope="module")
def decayed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("decayed")
    train(run(folder, 40, *WSD, FORGETFUL))
    return folder


@pytest.fixture
def copy(tmp_path: Path, decayed: Path) -> Path:
    shutil.copytree(decayed, tmp_path / "copy")
    return tmp_path / "copy"


def contents(folder: Path) -> dict[Path, bytes]:
    return {f: f.read_bytes() for f in folder.rglob("*") if f.is_file() and f.name != ".lock"}


@pytest.mark.parametrize("problem", ["gone", "damaged", "patches"])
def test_without_the_checkpoint_before_the_decay_it_is_refused(copy: Path, problem: str) -> None:
    stable = copy / "run" / "stable.ckpt"
    if problem == "gone":
        stable.unlink()
    elif problem == "damaged":
        stable.write_bytes(stable.read_bytes()[:-1])
    else:
        only_here = segments(stable) - segments(copy / "run" / "last.ckpt")
        (copy / "run" / "patches" / min(only_here)).unlink()
    before = contents(copy)
    with pytest.raises(ValueError, match=r"decayed since step 20, .*run\.folder=… for the longer"):
        train(run(copy, 80, *WSD, FORGETFUL))
    assert contents(copy) == before


def test_of_a_start_that_was_killed_no_checkpoint_is_left_whose_rate_had_decayed(
    copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It had put the checkpoint before the decay in the last one's place, and no more."""
    previous = copy / "run" / "previous.ckpt"
    shutil.copy(copy / "run" / "stable.ckpt", copy / "run" / "last.ckpt")
    assert previous.exists()
    monkeypatch.setattr(RunFolder, "begin", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(run(copy, 80, *WSD, FORGETFUL))
    assert not previous.exists()


def test_a_rate_that_falls_from_the_first_step_on_allows_nothing_longer(tmp_path: Path) -> None:
    cosine = ("schedule=cosine", "schedule.warmup_steps=3")
    train(run(tmp_path, 12, *cosine))
    assert not (tmp_path / "run" / "stable.ckpt").exists()
    with pytest.raises(ValueError, match=r"decays from the first step on"):
        train(run(tmp_path, 20, *cosine))


@pytest.mark.parametrize(
    ("steps", "override", "words"),
    [
        (20, "seed=0", r"budget\.steps: 40 there, 20 now"),
        (80, "seed=1", r"seed: 0 there, 1 now"),
        (80, "schedule.decay_share=0.25", r"schedule\.decay_share: 0\.5 there, 0\.25 now"),
    ],
)
def test_what_is_not_just_longer_is_another_run(
    copy: Path, steps: int, override: str, words: str
) -> None:
    before = contents(copy)
    with pytest.raises(ValueError, match=words):
        train(run(copy, steps, *WSD, FORGETFUL, override))
    assert contents(copy) == before


@pytest.mark.parametrize(
    ("former", "now", "longer"),
    [
        ((20, None), (40, None), True),
        ((None, 60.0), (None, 61.0), True),
        ((20, 60.0), (20, None), True),
        ((20, None), (20, None), False),
        ((20, 60.0), (40, 30.0), None),
        ((20, None), (None, 60.0), None),
    ],
)
def test_longer_means_neither_limit_is_smaller(
    tmp_path: Path, former: tuple, now: tuple, longer: bool | None
) -> None:
    first, second = (
        {"budget": {"steps": steps, "seconds": seconds, "clock": "wall"}}
        for steps, seconds in (former, now)
    )
    begun = RunFolder(tmp_path, settings=first)
    begun.begin()
    begun.write_result({"finished": True})
    written = json.loads((tmp_path / "result.json").read_text())
    begun.close()
    if longer is None:
        with pytest.raises(ValueError, match="holds another run"):
            RunFolder(tmp_path, settings=second)
        return
    again = RunFolder(tmp_path, settings=second)
    assert again.lengthened == longer
    assert again.identity == begun.identity
    assert written["finished"]
    assert again.result == (None if longer else written)
    again.close()


def test_path_tracing_is_never_lengthened(tmp_path: Path) -> None:
    settings = {"path_tracing": {}, "budget": {"steps": 20, "seconds": None}}
    begun = RunFolder(tmp_path, settings=settings)
    begun.begin()
    begun.write_result({"finished": True})
    begun.close()
    with pytest.raises(ValueError, match="20 there, 30 now"):
        RunFolder(tmp_path, settings={**settings, "budget": {"steps": 30, "seconds": None}})
