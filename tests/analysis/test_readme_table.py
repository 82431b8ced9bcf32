"""docs/results.md, docs/small and the program's rules say the same about the claims."""

import re
from itertools import groupby
from pathlib import Path

import pytest

from analysis.claim_tables import claims_table
from analysis.evidence import Verdict, of_tests
from analysis.methods import name_methods
from analysis.readme_table import (
    BEGIN,
    BEGIN_VERDICTS,
    BEGIN_WITH_OURS,
    END,
    between_markers,
    claim_lines,
    main,
    readme_table,
    with_tables,
)
from analysis.runs import find_runs
from analysis.tables import to_markdown
from analysis.verdicts import judge

ROOT = Path(__file__).resolve().parents[2]


REPORTS = [
    "docs/small/results.md",
    "docs/small/ours/results.md",
    "docs/small/ours/claims/results.md",
]


@pytest.mark.parametrize("name", ["README.md", "docs/results.md"])
def test_pages_have_the_numbers_and_verdicts_of_the_reports(name: str) -> None:
    page = (ROOT / name).read_text()
    reports = [(ROOT / report).read_text() for report in REPORTS]
    assert page == with_tables(page, *reports), (
        f"python -m analysis.readme_table {' '.join(REPORTS)} {name} writes it"
    )


def test_the_verdicts_with_both_learners_stand_side_by_side() -> None:
    heading = "**Claims of the paper**\n\n|claim|of the claim|\n|-|-|\n"
    rows = "|chess|reproduced|\n|ours_chess|inconclusive|\n|ours_chess||\n|anf|not reproduced|\n"
    page = with_tables(f"{BEGIN_VERDICTS}\n{END}", f"{heading}{rows}\n")
    lines = [line for line in page.splitlines() if line.startswith("| ")]
    assert len(lines) == 12
    assert lines[-1] == "| 128 variables | **reproduced** | inconclusive |"
    assert lines[-2].endswith("| **not reproduced** | not run |")
    assert lines[1].endswith("| not run | not run |")


@pytest.mark.parametrize("report", REPORTS)
def test_verdicts_follow_from_the_tests_of(report: str) -> None:
    lines = claim_lines((ROOT / report).read_text())
    for claim, grouped in groupby(lines, lambda line: line["claim"]):
        primary, *further = list(grouped)
        verdict = of_tests(Verdict(primary["verdict"]), [Verdict(f["verdict"]) for f in further])
        assert primary["test"] == "primary", claim
        assert primary["of the claim"] == verdict, claim
        assert {(line["test"], line["of the claim"]) for line in further} <= {("further", "")}


def test_verdicts_are_those_of_the_judge(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("active_exploration", scene="living-room", seed=seed, error=0.05)
        make_method("constant_resolution", scene="living-room", seed=seed)
        make_method("uniform", scene="living-room", seed=seed)
        make_method("uniform_growing", scene="living-room", seed=seed, error=0.05)
        make_method("no_preconditioning", scene="living-room", seed=seed)
        make_method("active_exploration", scene="chess", seed=seed, error=0.04)
    claims = judge(name_methods(find_runs(tmp_path)[0]))
    table = readme_table(f"intro\n\n{to_markdown(claims_table(claims))}\n\n**next**")
    judged = {c.claim.title: str(c.verdict) for c in claims if c.verdict != "not run"}
    rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in table.splitlines()[2:]]
    assert {row[0]: row[3].strip("*") for row in rows} == judged
    assert set(judged.values()) == {"reproduced", "inconclusive"}
    assert all(re.match(r"[+-]?\d|–", row[2]) for row in rows)


def test_claims_judged_with_ours_have_a_table_of_their_own(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("ours_exploring", scene="living-room", seed=seed, error=0.05)
        make_method("ours_uniform", scene="living-room", seed=seed)
    claims = judge(name_methods(find_runs(tmp_path)[0]))
    results = f"intro\n\n{to_markdown(claims_table(claims))}\n\n**next**"
    papers, ours = f"{BEGIN}\n\nold\n\n{END}", f"{BEGIN_WITH_OURS}\n\nold\n\n{END}"
    page = with_tables(f"{papers}\n{ours}", results)
    assert readme_table(results) == ""
    assert page.startswith(papers)
    assert "old" not in page.removeprefix(papers)
    assert "with our learner" in page.removeprefix(papers)


def test_a_claim_that_two_reports_have_runs_of_is_the_first_ones() -> None:
    columns = ("claim", "test", "compared", "difference", "of the claim")
    heading = f"**Claims of the paper**\n\n|{'|'.join(columns)}|\n|-|-|-|-|-|\n"

    def report(name: str, *claims: str, test: str = "primary") -> str:
        rows = [f"|{claim}|{test}|{name}|1|inconclusive|" for claim in claims]
        return heading + "\n".join(rows) + "\n\n"

    one, other = report("one", "chess"), report("other", "resolution", "chess")
    rows = readme_table(one, other).splitlines()[2:]
    assert [row.split(" | ")[1] for row in rows] == ["other", "one"]
    (row,) = readme_table(report("beside", "chess", test="further")).splitlines()[2:]
    assert row.split(" | ")[1:3] == ["not run", ""]


def test_what_is_missing_is_said(tmp_path, capsys) -> None:
    with pytest.raises(ValueError, match="no table"):
        readme_table("nothing")
    with pytest.raises(ValueError, match="put the lines"):
        with_tables("nothing", (ROOT / "docs/small/results.md").read_text())
    replaced = between_markers(f"a {BEGIN} old {END} b", "t", begin=BEGIN, end=END)
    assert replaced == f"a {BEGIN}\n\nt\n\n{END} b"
    assert main([str(tmp_path / "none"), str(ROOT / "docs" / "results.md")]) == 1
    assert "none" in capsys.readouterr().err
    assert main([]) == 2
