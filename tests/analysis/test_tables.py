import json
import math
import re

import pandas as pd
import pytest

from analysis.latex import escape, to_latex
from analysis.methods import baselines, name_methods, title
from analysis.report_files import write_report
from analysis.runs import METRICS, SETS, find_runs
from analysis.statistics import Estimate, estimate
from analysis.summary import Comparison, compare, summarise, to_frame
from analysis.tables import (
    Cell,
    Table,
    comparison_table,
    cost_table,
    error_table,
    format_estimate,
    format_number,
    to_markdown,
    to_terminal,
    worst_table,
)
from analysis.time_table import time_table


def test_a_row_has_a_cell_below_every_title() -> None:
    with pytest.raises(ValueError, match="results: 1 cells below 2 titles"):
        Table("results", ("scene", "MAPE"), ((Cell("mirror"),),), 1)


@pytest.fixture
def summaries(make_run, tmp_path):  # type: ignore[no-untyped-def]
    for seed in range(3):
        make_run(seed=seed)
        make_run(seed=seed, sampler="mcmc_loss_step", quality=1.25)
    return summarise(name_methods(find_runs(tmp_path)[0]))


def test_summaries_are_the_means_over_the_seeds(summaries) -> None:
    assert [s.method for s in summaries] == ["uniform", "mcmc_loss_step", "reference noise"]
    uniform = summaries[0]
    values = [run.result["metrics"]["hard"]["dssim"]["mean"] for run in uniform.runs]
    assert len(values) == 3
    assert uniform.values["hard_dssim"] == estimate(values)
    assert uniform.values["hard_dssim_worst5"].mean == pytest.approx(2 * sum(values) / 3)
    assert summaries[2].values["uniform_mae"] == Estimate(pytest.approx(0.005), None, 1)


def test_lpips_of_some_runs_only_is_left_empty(make_run, tmp_path) -> None:
    make_run(seed=0)
    make_run(seed=1, lpips=False)
    (uniform, noise) = summarise(name_methods(find_runs(tmp_path)[0]))
    assert uniform.values["hard_lpips"] is None
    assert noise.values["hard_lpips"] is not None
    assert to_terminal(error_table([uniform])).splitlines()[3].split()[-1] == "–"


def test_comparison_is_paired_and_relative_to_uniform(summaries) -> None:
    (comparison,) = compare(summaries)
    assert (comparison.baseline, comparison.other) == ("uniform", "mcmc_loss_step")
    differences = []
    for a, b in zip(summaries[0].runs, summaries[1].runs, strict=True):
        assert a.seed == b.seed
        values = [run.result["metrics"]["hard"]["mape"]["mean"] for run in (a, b)]
        differences.append(values[1] / values[0] - 1)
    result = comparison.differences["hard_mape"]
    assert result.mean == pytest.approx(sum(differences) / 3)
    assert f"{100 * result.mean:+.1f}" in to_terminal(comparison_table([comparison]))


def test_every_method_is_compared_with_the_baseline(make_run, tmp_path) -> None:
    def pairs() -> list[tuple[str, str]]:
        comparisons = compare(summarise(name_methods(find_runs(tmp_path)[0])))
        return [(comparison.baseline, comparison.other) for comparison in comparisons]

    make_run(sampler="mcmc_loss")
    assert pairs() == []
    make_run(sampler="mcmc_loss_step")
    make_run(sampler="mcmc_gradient")
    assert pairs() == [("mcmc_gradient", "mcmc_loss"), ("mcmc_gradient", "mcmc_loss_step")]
    make_run()
    others = ("mcmc_gradient", "mcmc_loss", "mcmc_loss_step")
    assert pairs() == [("uniform", other) for other in others]


def test_a_method_is_compared_with_the_baseline_of_its_own_budget(make_run, tmp_path) -> None:
    for budget in ("hour", "small"):
        make_run(method="uniform", budget=budget)
        make_run(method="active_exploration", budget=budget)
    runs = name_methods(find_runs(tmp_path)[0])
    pairs = [(found.baseline, found.other) for found in compare(summarise(runs))]
    expected = [(f"uniform, {b}", f"active_exploration, {b}") for b in ("hour", "small")]
    assert pairs == expected
    rows = [[cell.text for cell in row[1:3]] for row in time_table(runs).rows]
    assert rows == [[title(other), title(baseline)] for baseline, other in expected]


def test_others_are_compared_with_what_is_asked_for(make_run, tmp_path) -> None:
    for method in ("uniform", "active_exploration", "ours"):
        make_run(method=method)
    runs = name_methods(find_runs(tmp_path)[0])
    found = compare(summarise(runs), baseline="ours")
    assert {(each.baseline, each.other) for each in found} == {
        ("ours", "uniform"),
        ("ours", "active_exploration"),
    }
    rows = time_table(runs, baseline="ours").rows
    assert {row[2].text for row in rows} == {title("ours")}
    with pytest.raises(ValueError, match=r"--baseline mine: .* there are 'uniform', 'active_expl"):
        write_report(tmp_path, tmp_path / "report", baseline="mine")
    assert not (tmp_path / "report").exists()


def test_without_uniform_sampling_each_budget_has_a_first_method() -> None:
    budgets = {"a, hour": "hour", "a, small": "small", "b, hour": "hour", "b, small": "small"}
    assert baselines(budgets) == [("b, hour", "a, hour"), ("b, small", "a, small")]


def test_without_a_baseline_of_its_own_budget_any_is_better_than_none(make_run, tmp_path) -> None:
    make_run(method="uniform", budget="hour")
    make_run(method="active_exploration", budget="small")
    (comparison,) = compare(summarise(name_methods(find_runs(tmp_path)[0])))
    assert (comparison.baseline, comparison.other) == ("uniform", "active_exploration")


def test_a_metric_that_one_seed_lacks_is_not_compared(make_run, tmp_path) -> None:
    for seed in range(3):
        make_run(seed=seed)
        make_run(sampler="mcmc_loss", seed=seed, lpips=seed == 0)
    (comparison,) = compare(summarise(name_methods(find_runs(tmp_path)[0])))
    assert comparison.differences["hard_lpips"] is None
    assert comparison.differences["hard_mape"] is not None
    assert comparison.differences["hard_mape"].n == 3


def test_undefined_difference_is_shown_as_missing() -> None:
    differences = {f"{s}_{m}": Estimate(math.nan, None, 1) for s in SETS for m in METRICS}
    text = to_terminal(comparison_table([Comparison("s", "a", "b", differences)]))
    assert text.splitlines()[-1].split()[-8:] == ["–"] * 8


def test_frame_holds_every_number(summaries, tmp_path) -> None:
    to_frame(summaries).to_csv(tmp_path / "results.csv", index=False)
    frame = pd.read_csv(tmp_path / "results.csv")
    row = frame[frame.method == "mcmc_loss_step"].iloc[0]
    value = summaries[1].values["uniform_lpips_worst5"]
    assert row["uniform_lpips_worst5"] == pytest.approx(value.mean)
    assert row["uniform_lpips_worst5_interval"] == pytest.approx(value.half_width)
    assert (row["seeds"], row["sampler"]) == ("0 1 2", "mcmc_loss_step")
    assert row["paths_traced"] == 524288000
    assert math.isnan(frame[frame.method == "reference noise"].iloc[0]["steps"])


def test_frame_has_further_errors_where_runs_know_them(make_run, tmp_path) -> None:
    def measured(result: dict) -> None:
        result["relmse"] = {"hard": 0.01 * (1 + result["seed"]), "uniform": 0.5}
        result["tail"] = {"hard": 0.25, "uniform": 0.125}

    for seed in range(3):
        make_run(seed=seed, change=measured)
        make_run(seed=seed, sampler="older")
    frame = to_frame(summarise(name_methods(find_runs(tmp_path)[0]))).set_index("method")
    assert frame.loc["uniform", "hard_relmse"] == pytest.approx(0.02)
    # Student's t of two degrees of freedom at 97.5 %, the standard deviation 0.01
    half_width = 4.302653 * 0.01 / math.sqrt(3)
    assert frame.loc["uniform", "hard_relmse_interval"] == pytest.approx(half_width)
    assert frame.loc["uniform", "uniform_tail"] == 0.125
    assert frame.loc["older", ["hard_relmse", "uniform_tail"]].isna().all()


def test_the_best_mean_of_a_scene_is_marked(summaries) -> None:
    lines = to_terminal(error_table(summaries)).splitlines()
    marks = {line.split()[1]: line.count("*") for line in lines[3:]}
    assert marks == {"uniform": 0, "mcmc_loss_step": 8, "reference": 0}
    assert to_markdown(worst_table(summaries)).count("**") == 2 + 2 * 8
    assert to_terminal(worst_table(summaries)).count(" ± ") == 2 * 8
    assert "*" not in to_terminal(cost_table(summaries))


def test_costs_tell_what_a_frame_takes_where_runs_know_it(make_run, tmp_path) -> None:
    make_run()
    new = make_run(sampler="mcmc_loss_step") / "result.json"
    seconds = {"buffers": 0.5, "inputs": 0.25, "network": 0.012}
    new.write_text(json.dumps({**json.loads(new.read_text()), "frame_seconds": seconds}))
    table = cost_table(summarise(name_methods(find_runs(tmp_path)[0])))
    assert table.columns[-1] == "ms per frame"
    found = {row[1].text: row[-1].text for row in table.rows}
    assert found == {"uniform sampling": "–", "mcmc_loss_step": "762"}


def test_path_tracing_alone_needs_no_buffers(make_run, tmp_path) -> None:
    seconds = {"buffers": 0.5, "inputs": 0.25, "network": 0.012}
    for sampler, denoiser in (("plain", None), ("denoised", {"_target_": "Denoiser"})):
        file = make_run(sampler=sampler) / "result.json"
        result = json.loads(file.read_text())
        result["config"]["path_tracing"] = {"denoiser": denoiser}
        file.write_text(json.dumps({**result, "frame_seconds": seconds}))
    rows = cost_table(summarise(name_methods(find_runs(tmp_path)[0]))).rows
    assert {row[1].text: row[-1].text for row in rows} == {"plain": "262", "denoised": "762"}


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_mean_that_is_not_finite_is_never_the_best(make_run, tmp_path, bad, first) -> None:
    def spoil(result: dict) -> None:
        result["metrics"]["hard"]["mape"]["mean"] = bad

    make_run(sampler="a", **({"change": spoil} if first else {}))
    make_run(sampler="b", **({} if first else {"change": spoil}))
    (a, b, _) = error_table(summarise(name_methods(find_runs(tmp_path)[0]))).rows
    assert (a[3].best, b[3].best) == (not first, first)


@pytest.mark.usefixtures("undrawn")
def test_tables_count_the_seeds_that_diverged(make_run, tmp_path) -> None:
    """Of two methods with three seeds, one seed of the first ends with hard frames of NaN."""

    def spoil(result: dict) -> None:
        for metric in METRICS:
            result["metrics"]["hard"][metric].update(mean=math.nan, worst5=math.nan)

    for seed in range(3):
        make_run(seed=seed, sampler="steady")
        file = make_run(seed=seed, **({"change": spoil} if seed == 1 else {})) / "metrics.csv"
        if seed == 1:
            table = pd.read_csv(file)
            hard = [name for name in table if name.startswith("hard")]
            table.loc[len(table) - 1, hard] = math.nan
            table.to_csv(file, index=False)
    report = tmp_path / "report"
    text = write_report(tmp_path / "runs", report).text
    counts = pd.read_csv(report / "results.csv").set_index("method")["diverged"]
    assert counts.drop("reference noise").to_dict() == {"uniform": 1, "steady": 0}
    written = {name: (report / name).read_text() for name in ("results.md", "results.tex")}
    for name, content in {"terminal": text, **written}.items():
        rows = [line for line in content.splitlines() if "mirror" in line and "nan" in line]
        assert rows, name
        assert all("3 (1 diverged)" in row for row in rows), name
        assert not re.search(r"steady\W.*diverged", content), name
    page = (report / "index.html").read_text()
    assert page.count("<td>3 (1 diverged)</td>") == 5  # two tables of either set, and the costs


def test_numbers_have_three_significant_digits() -> None:
    numbers = [0.1234, 0.01234, 1.234, 123.4, 0.0, 1e-9, math.nan]
    texts = ["0.123", "0.0123", "1.23", "123", "0.000", "0.00000", "nan"]
    assert [format_number(number) for number in numbers] == texts
    assert format_estimate(Estimate(0.1234, 0.0456, 3)) == "0.123 ± 0.046"
    assert format_estimate(Estimate(0.1234, None, 1)) == "0.123"


def test_latex_has_no_sign_that_it_does_not_know() -> None:
    text = escape("≥9.2 ± 1 – ε ≤ 0.85 ×")
    assert text.isascii()
    assert text.startswith(r"$\ge$9.2")


def test_latex_has_minus_signs_before_numbers_alone() -> None:
    assert escape("-1.5 % (-2, 3) pre-trained 1e-3 a-1") == (
        r"$-$1.5 \% ($-$2, 3) pre-trained 1e-3 a-1"
    )


def test_latex_breaks_long_text_into_lines() -> None:
    long = "Active Exploration against uniform sampling, sphere-caustic"
    rows = tuple((Cell("same_time"), Cell(text), Cell("1")) for text in (long, "short"))
    text = to_latex(Table("Claims", ("claim", "compared", "seeds"), rows, 2))
    assert r"\begin{tabular}{lp{9em}r}" in text
    assert rf"same\_time & \raggedright {long} & 1 \\" in text
    assert r"same\_time & short & 1 \\" in text
    assert r"{lr}" in to_latex(Table("Claims", ("claim", "seeds"), (), 1))


def test_latex_is_escaped() -> None:
    assert escape(r"a_b & 5 % of #1 {x} $ \ ~ ^") == (
        r"a\_b \& 5 \% of \#1 \{x\} \$ \textbackslash{} \textasciitilde{} \textasciicircum{}"
    )
    rows = ((Cell("mcmc_loss"), Cell("0.1 ± 0.2", best=True)), (Cell("b&c"), Cell("–")))
    text = to_latex(Table("Worst 5 %", ("method", "MAPE"), rows, 1))
    assert r"\caption{Worst 5 \%}" in text
    assert r"mcmc\_loss & \textbf{0.1 $\pm$ 0.2} \\" in text
    assert r"b\&c & -- \\" in text


def test_latex_groups_columns_and_its_rows_have_as_many_cells(summaries) -> None:
    for table in (error_table(summaries), worst_table(summaries), cost_table(summaries)):
        text = to_latex(table)
        widths = {
            line.count("&") + 1
            for line in text.splitlines()
            if line.endswith(r"\\") and "multicolumn" not in line
        }
        assert widths == {len(table.columns)}
        assert text.count("{") == text.count("}")
    text = to_latex(error_table(summaries))
    assert r"\multicolumn{4}{c}{hard} & \multicolumn{4}{c}{uniform} \\" in text
    assert r"\cmidrule(lr){4-7}\cmidrule(lr){8-11}" in text


def test_tables_for_the_terminal_fit_it(summaries) -> None:
    for name in ("hard", "uniform"):
        for table in (error_table(summaries, [name]), worst_table(summaries, [name])):
            assert max(map(len, to_terminal(table).splitlines())) <= 120


def test_markdown_keeps_underscores_and_bars() -> None:
    text = to_markdown(Table("T", ("a",), ((Cell("x_y|z"),),), 1))
    assert r"x\_y\|z" in text
