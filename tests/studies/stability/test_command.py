from pathlib import Path

import pandas as pd
import pytest

from ngi.studies.stability.__main__ import main, markdown, run
from ngi.studies.stability.case import Case, Conditions, Outcome


def outcome(**given: object) -> Outcome:
    return Outcome(**{"finite": True, "done": "", **given})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "passed"),
    [
        ({}, True),
        ({"finite": False}, False),
        ({"as_expected": False}, False),
        ({"error": 0.1, "limit": 0.2}, True),
        ({"error": 0.3, "limit": 0.2}, False),
        ({"error": float("nan"), "limit": 0.2}, False),
        ({"error": 0.3}, True),  # only reported
        ({"limit": 0.2}, False),  # wanted, and not measured
    ],
)
def test_a_case_passes_if_it_is_finite_small_and_as_expected(given: dict, passed: bool) -> None:
    assert outcome(**given).passed is passed


def test_every_combination_of_conditions_is_run_and_an_error_is_a_failure() -> None:
    def odd(conditions: Conditions) -> Outcome:
        if conditions.precision == "bf16":
            raise ArithmeticError("too coarse")
        return outcome()

    over = {"sampler": ("a", "b"), "precision": ("fp32", "bf16")}
    rows = run({"group": [Case("odd", odd, over), Case("other", odd, {})]}, matching="odd")
    conditions = [(row.conditions.sampler, row.conditions.precision) for row in rows]
    assert conditions == [("a", "fp32"), ("a", "bf16"), ("b", "fp32"), ("b", "bf16")]
    assert [row.outcome.passed for row in rows] == [True, False, True, False]
    assert rows[1].outcome.done == "raised ArithmeticError: too coarse"
    table = pd.DataFrame([row.columns() for row in rows])
    assert table["verdict"].tolist() == ["ok", "FAILED"] * 2
    shown = markdown(table)
    assert "| odd    | a         | fp32" in shown
    assert "backend" not in shown  # nobody's


def test_the_report_is_written_and_a_failure_is_the_exit_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "stability.csv").write_text("of all cases")
    assert main(["reuse", f"output={tmp_path}"]) == 0
    table = pd.read_csv(tmp_path / "stability_part.csv")
    assert set(table["verdict"]) == {"ok"}
    assert "0 failed" in capsys.readouterr().out
    assert (tmp_path / "stability_part.md").read_text().startswith("### reuse")
    assert (tmp_path / "stability.csv").read_text() == "of all cases"
    monkeypatch.setattr("ngi.reuse.policies._sigmoid", lambda x: 1 / (1 + 2.7**-x))
    assert main(["reuse", "matching=averages", f"output={tmp_path}"]) == 1
    assert "OverflowError" in (tmp_path / "stability_part.md").read_text()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nothing"], "no group nothing; there are "),
        (["reuse", "matching=nothing"], "no case has 'nothing' in its name; there are "),
    ],
)
def test_what_is_not_there_is_named(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main([*arguments, f"output={tmp_path}"]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
