"""The cases that take no long: those of training on one sampler, those of rendering on LLVM."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from ngi.learn import StepGuard
from ngi.studies.stability.case import Case, Conditions, attempt
from ngi.studies.stability.groups import GROUPS
from tests.learn.lightning_warnings import IGNORED

pytestmark = IGNORED


SLOW = ("dimensions", "learning rate", "in a pixel")


def quick() -> Iterator[object]:
    for group, cases in GROUPS.items():
        for case in cases:
            for conditions in case.conditions():
                if (
                    conditions.sampler in ("mcmc_loss_step", None)
                    and conditions.precision in ("fp32", None)
                    and conditions.backend in ("llvm", None)
                    and conditions.scene in ("mirror", None)
                    and not any(part in case.name for part in SLOW)
                ):
                    yield pytest.param(group, case, conditions, id=f"{group}-{case.name}")


@pytest.mark.parametrize(("group", "case", "conditions"), list(quick()))
def test_the_program_does_what_is_documented(
    group: str, case: Case, conditions: Conditions
) -> None:
    row = attempt(group, case, conditions)
    assert row.outcome.passed, row.columns()


@pytest.mark.parametrize("name", ["NaN in a loss", "NaN in a gradient", "NaN in Adam's moments"])
def test_without_the_guard_these_cases_fail(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    case = next(case for case in GROUPS["training"] if case.name == name)
    conditions = Conditions(sampler="uniform", precision="fp32")
    monkeypatch.setattr("ngi.learn.step_guard.LARGEST_NORM", float("inf"))
    monkeypatch.setattr(StepGuard, "admit", lambda *_: 0.0)
    assert not attempt("training", case, conditions).outcome.passed
