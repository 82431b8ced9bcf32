"""Every number of the configuration with values that are none, or no good one.

Either all parts of a run can be built with it, or a message that `ngi.train` shows names the key.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hydra.errors import HydraException
from hydra.utils import instantiate
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ngi import learn
from ngi.config.build import build_recorder, build_run, run_costs
from ngi.config.hydra_program import MESSAGES
from ngi.config.values import check_values
from ngi.learn.callbacks import callbacks
from tests.learn.composition import run_config

SMALL = (
    "renderer.patch_size=16",
    "resolution.start=32",
    "resolution.end=64",
    "model.hidden_features=16",
    "model.hidden_layers=2",
    "reuse.store.capacity=1000",
    "sampler.chains=4",
    "evaluation=smoke",
    "budget=seconds",
)
VARIANTS = (
    (),
    (
        "renderer=pockets",
        "sampler=sobol",
        "reuse=fixed",
        "method=prioritised_replay",
        "resolution=constant",
        "loss=l1_dssim_release",
    ),
    ("renderer=pockets", "sampler=mcmc_release", "reuse=epochs", "budget=steps"),
)
NAMES = {"lr": "learning rate", "seed": "seed"}
"""Words for a key in messages that are not ours."""

BAD = (
    float("nan"), float("inf"), float("-inf"), -1, -0.5, 0, -0.0, 1.5, 1e300, 1e-320, 10**18, 2**64,
    10**400, "", "word", "1e5x", None, True, [1], {"a": 1},
)  # fmt: skip


@cache
def base(variant: int) -> DictConfig:
    # Overrides of a part come after the part is chosen.
    config = run_config(*VARIANTS[variant], *(o for o in SMALL if "budget" not in o or not variant))
    OmegaConf.resolve(config)
    return config


def numbers(node: Any, path: str = "") -> Iterator[str]:
    """The keys of all numbers, and of those that may be left out."""
    for key, value in node.items():
        here = f"{path}{key}"
        if isinstance(value, DictConfig):
            yield from numbers(value, f"{here}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield here


KEYS = [
    (variant, key)
    for variant in range(len(VARIANTS))
    for key in numbers(base(variant))
    if not key.startswith(("trainer.", "scene."))
]


def is_new(variant: int, key: str) -> bool:
    """Whether the part with this key is another one than in the first variant."""
    part = key.partition(".")[0]
    return variant == 0 or base(variant)[part] != base(0).get(part)


def build(config: DictConfig, folder: Path) -> None:
    """All parts of a run, as `ngi.train` makes them before any long work."""
    check_values(config)
    budget, renderer = instantiate(config.budget), instantiate(config.renderer)
    costs = run_costs(config, budget=budget, renderer=renderer)
    place: Any = SimpleNamespace(path=folder, patches=folder, settings={"costs": costs})
    run = build_run(
        config,
        folder=place,
        tracker=learn.Local(),
        interruption=learn.Interruption(of="test"),
        budget=budget,
        renderer=renderer,
    )
    callbacks(
        run,
        recorder=build_recorder(config, run),
        evaluations=config.evaluation.count,
        checkpoint_seconds=config.run.checkpoint_seconds,
        checkpoint_steps=config.run.checkpoint_steps,
    )
    run.module.configure_optimizers()
    run.module.rehearse(run.samples.blank(2))


def problem(variant: int, changes: dict[str, Any], folder: Path) -> str | None:
    """What is wrong with how the configuration is refused; None where it builds or is."""
    config = base(variant).copy()
    try:
        for key, value in changes.items():
            OmegaConf.update(config, key, value, force_add=True)
        build(config, folder)
    except (*MESSAGES, HydraException, OmegaConfBaseException) as error:
        names = [key.rpartition(".")[2] for key in changes]
        words = [word for name in names for word in (name, NAMES.get(name, name))]
        if any(word in str(error) for word in words):
            return None
        return f"{changes}: {type(error).__name__} names no key: {error}"
    except Exception as error:
        return f"{changes}: {type(error).__name__}: {error}"
    return None


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("loss.l1_weight", float("nan"), "nan is not a finite number that can be used here"),
        ("run.checkpoint_seconds", float("inf"), "inf is not a finite number"),
        ("run.checkpoint_steps", 1e5, "100000.0 is not an integer or null"),
        ("sampler.chains", True, "True is not an integer"),
        ("sampler.chains", 2**31, "2147483648 is not an integer"),
        ("model.position_preconditioning", 1, "1 is not true or false"),
        ("reuse.when_late", 3, None),
    ],
)
def test_a_value_of_the_wrong_kind_is_named(key, value, said) -> None:
    config = base(0).copy()
    check_values(config)
    OmegaConf.update(config, key, value)
    if said is None:  # no argument of a class: what takes it checks it
        check_values(config)
        return
    with pytest.raises(ValueError, match=f"^{re.escape(f'{key}: {said}')}"):
        check_values(config)


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("sweep", "sweep: nothing reads this key; did you mean '+sweeps'?"),
        ("sampelr", "sampelr: nothing reads this key; did you mean 'sampler'?"),
        ("run.chekpoint_seconds", "…; did you mean 'run.checkpoint_seconds'?"),
        ("evaluation.cuont", "…; did you mean 'evaluation.count'?"),
        ("reuse.when_lat", "…; did you mean 'reuse.when_late'?"),
        ("scene.reeder", "…; did you mean 'scene.reader'?"),
        ("supersampled_edges", "supersampled_edges: nothing reads this key; leave it out"),
    ],
)
def test_a_key_that_nothing_reads_is_refused(key: str, said: str) -> None:
    """It would be without effect: `+` adds whatever it is given."""
    config = base(0).copy()
    OmegaConf.update(config, key, 3, force_add=True)
    with pytest.raises(ValueError, match=f"{re.escape(said.lstrip('…'))}$"):
        check_values(config)


def test_an_option_of_ones_own_may_keep_values_for_others_to_refer_to() -> None:
    config = base(0).copy()
    OmegaConf.update(config, "scene.year", 1843, force_add=True)
    check_values(config)


@pytest.mark.parametrize(("variant", "key"), [each for each in KEYS if is_new(*each)])
def test_no_value_gives_a_traceback(tmp_path, variant, key) -> None:
    problems = [problem(variant, {key: value}, tmp_path) for value in BAD]
    assert not [text for text in problems if text is not None]


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_nor_do_several(tmp_path, data) -> None:
    variant = data.draw(st.integers(0, len(VARIANTS) - 1))
    keys = st.sampled_from([key for number, key in KEYS if number == variant])
    changes = data.draw(st.dictionaries(keys, st.sampled_from(BAD), min_size=1, max_size=4))
    assert problem(variant, changes, tmp_path) is None
