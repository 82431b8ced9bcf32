"""README, start page and page of results say no more than their tables do."""

import json
import math
import re

import numpy as np
import pandas as pd
import pytest

from analysis.exploration_map.runs import at_base
from analysis.readme_table import judged_claims
from analysis.runs import METRICS
from analysis.statistics import paired_difference
from tests.docs.pages import ROOT

FRACTIONS = {"a thirteenth": 1 / 13, "a ninth": 1 / 9, "a third": 1 / 3}


def said(page: str, pattern: str) -> tuple[str, ...]:
    found = re.search(pattern, (ROOT / page).read_text())
    assert found, f"{page} has no '{pattern}' any more: change this test with it"
    return found.groups()


def geometric_mean(evaluations: pd.DataFrame, frames: str, worst: str = "") -> pd.Series:
    """Of the metrics on "hard" or "uniform" frames; worst: "_worst5" for the worst 5 % of them."""
    metrics = [f"{frames}_{metric}{worst}" for metric in METRICS]
    return np.log(evaluations[metrics]).mean(axis=1).map(math.exp)


def test_the_readme_says_of_ours_exploring_what_its_report_says() -> None:
    judged = judged_claims((ROOT / "docs/small/ours/results.md").read_text())
    shown = said(
        "README.md", r"chains have (\d\.\d) % more error .*?sampling \((\d\.\d) to (\d\.\d)\)"
    )
    assert judged["ours_same_time"]["difference"] == "+{} % [+{}, +{}]".format(*shown)


def time_to_the_papers_error() -> float:
    words = r"at most (0\.\d+) to (0\.\d+) of its run time"
    shown = said("docs/learner/README.md", words)
    ends = geometric_mean(learner_errors().loc["active_exploration"], "hard")
    first = pd.read_csv(ROOT / "docs/learner/first_seconds.csv")
    first["below"] = geometric_mean(first, "hard") < first["scene"].map(ends)
    assert set(first.groupby("scene")["seed"].nunique()) == {3}
    of_seeds = first[first["below"]].groupby(["scene", "seed"])["run_seconds"].min()
    assert len(of_seeds) == 7 * 3
    shares = of_seeds.groupby("scene").max() / 75
    assert shown == (f"{shares.min():.3f}", f"{shares.max():.3f}")
    return float(shown[1])


@pytest.mark.parametrize(
    ("page", "pattern"),
    [
        ("README.md", r"with within (a ninth) of its time on all seven"),
        ("docs/index.md", r"ends with in (a ninth) of its time"),
    ],
)
def test_ours_is_not_said_to_be_faster_than_it_is(page: str, pattern: str) -> None:
    assert time_to_the_papers_error() <= FRACTIONS[said(page, pattern)[0]]


@pytest.mark.parametrize("page", ["README.md", "docs/learner/README.md"])
def test_ours_is_better_after_a_minute_on_as_many_scenes_as_is_said(page: str) -> None:
    errors = pd.read_csv(ROOT / "docs/learner/minute.csv").set_index(["method", "scene"])
    errors = errors[[f"hard_{metric}" for metric in METRICS]]
    ours = errors.loc["ours"]
    better = [
        int((ours < errors.loc[method].loc[ours.index]).all(axis=1).sum())
        for method in ("active_exploration", "path_tracing_oidn_8spp")
    ]
    figures = said(page, r"in all four metrics on (\d+) of (\d+) scenes.+?pixel on (\d+)")
    assert [int(figure) for figure in figures] == [better[0], len(ours), better[1]]


def learner_errors() -> pd.DataFrame:
    """Final errors of the learner's main table: by method and scene, a column per metric."""
    errors = pd.read_csv(ROOT / "docs/learner/results.csv").set_index(["method", "scene"])
    return errors[[f"hard_{metric}" for metric in METRICS]]


def test_ours_has_less_error_on_all_seven_scenes_after_75_seconds() -> None:
    errors = learner_errors()
    ours = errors.loc["ours"]
    assert len(ours) == 7
    for method in ("active_exploration", "path_tracing_oidn_8spp"):
        assert (ours < errors.loc[method].loc[ours.index]).all(axis=None)
    for page, words in {  # that what is checked is what is said
        "README.md": r"than the denoiser, (on all seven)\*\*, by the other two metrics as well",
        "docs/learner/README.md": r"\*\*(On all seven) scenes ours has less error than Open Image",
        "docs/results.md": r"has less error than the denoiser (on all seven) scenes",
        "docs/small/README.md": r"has less error (on all seven) scenes",
    }.items():
        said(page, words)


def test_the_learner_s_page_says_how_much_less_error_ours_has() -> None:
    errors = geometric_mean(learner_errors(), "hard")

    def less(method: str) -> pd.Series:
        return 100 * (1 - errors["ours"] / errors[method][errors["ours"].index])

    papers, before = less("active_exploration"), less("ours_before")
    order = ("veach-door", "bedroom", "sphere-caustic", "living-room")
    assert [papers.idxmin(), papers.idxmax()] == list(order[:2])
    words = (
        r"four errors is (\d+) % \(`veach-door`\) to (\d+) % \(`bedroom`\) lower; (\d+) % on "
        r"`sphere-caustic`, (\d+) % on `living-room`"
    )
    page = "docs/learner/README.md"
    assert said(page, words) == tuple(f"{papers[scene]:.0f}" for scene in order)
    assert [before.idxmin(), before.idxmax()] == ["veach-door", "sphere-caustic"]
    words = r"fallen by ([\d.]+) % \(`veach-door`\) to ([\d.]+) % \(`sphere-caustic`\)"
    assert said(page, words) == (f"{before.min():.1f}", f"{before.max():.1f}")


def test_a_frame_of_ours_takes_the_share_of_the_denoisers_time_that_is_said() -> None:
    measured = range_of("ours / paths and denoiser")
    readme = r"A frame of ours takes (0\.\d+) to (0\.\d+) of the denoiser's time, on the six"
    assert said("README.md", readme) == measured
    page = r"A frame of ours takes (0\.\d+) to (0\.\d+) of the denoiser's time"
    assert said("docs/learner/README.md", page) == measured
    fewer = r"With 8 rays per pixel in place of 16 it takes (0\.\d+) to (0\.\d+)"
    assert said("docs/learner/README.md", fewer) == range_of("ours with 8 rays / paths and")
    again = said("README.md", r"half the rays.+? it takes (0\.\d+) to (0\.\d+), and still has less")
    assert again == range_of("ours with 8 rays / paths and")
    names = ("ours / paths and denoiser", "ours with 8 rays / paths and")
    both = [figure for name in names for figure in range_of(name, "frames-xeon")]
    xeon = r"takes (0\.\d+) to (0\.\d+) of the denoiser's time, and (0\.\d+) to (0\.\d+) with 8"
    assert said("docs/learner/README.md", xeon) == tuple(both)
    assert said("README.md", r"on an Intel Xeon (0\.\d+) to (0\.\d+);") == tuple(both[:2])


@pytest.mark.parametrize("page", ["README.md", "docs/learner/README.md"])
def test_with_half_the_rays_ours_is_better_on_as_many_scenes_as_is_said(page: str) -> None:
    metrics = [f"hard_{metric}" for metric in METRICS]
    tables = (pd.read_csv(ROOT / f"docs/learner/{name}.csv") for name in ("rays", "results"))
    ours, all_methods = (table.dropna(subset="seeds").set_index("scene") for table in tables)
    denoised = all_methods[all_methods["method"] == "path_tracing_oidn_8spp"]
    better = (ours[metrics] < denoised.loc[ours.index, metrics]).all(axis=1)
    assert len(better) == 6
    (number,) = said(page, r"in all four metrics on (\w+) of the six(?: scenes\*\*|\.)")
    assert number == {3: "three", 4: "four", 5: "five"}[better.sum()]


def range_of(name: str, file: str = "frames") -> tuple[str, str]:
    """Smallest and largest median of the frames' figures that are called so."""
    figures = json.loads((ROOT / f"docs/learner/{file}.json").read_text())["figures"]
    medians = [figure["median"] for figure in figures if figure["name"].startswith(name)]
    assert len(medians) == 6 * 3
    return f"{min(medians):.2f}", f"{max(medians):.2f}"


def test_the_readme_says_of_predicted_losses_what_their_table_says() -> None:
    less = r"-(\d+\.\d) ± (\d+\.\d) %"
    row = rf"base +\| 4000 +\| no +\| predicted loss .+?{less} \| +{less} \| +(\d+) \|"
    *measured, times = said("docs/exploration-ceiling/long/errors.md", row)
    *shown, share = said(
        "README.md",
        r"new .+ (\d+) % ± (\d+) less on the worst .+? (\d+) % ± (\d+) less on av.+, in 1/(\d+) \|",
    )
    assert shown == [f"{float(figure):.0f}" for figure in measured]
    assert share == times
    eager = rf"base .+?predicted loss, eager .+?{less} \| +{less} \| +(\d+\.\d) \|"
    *tail, mean, interval, ratio = said("docs/exploration-ceiling/eager/errors.md", eager)
    assert float(mean) < float(interval)
    words = r"(\d+) % ± (\d+) less error on the worst frames\]\S+ and no more .+? in 1/(\d+) of"
    assert said("README.md", words) == tuple(f"{float(each):.0f}" for each in (*tail, ratio))


def test_the_readme_says_of_the_oracle_what_the_study_says() -> None:
    found = pd.read_csv(ROOT / "docs/exploration-ceiling/differences.csv")
    (row,) = found.query(
        "scene == 'all of them' and steps == 1600 and choice == 'oracle' and error == 'hard_error'"
    ).to_dict("records")
    measured = f"{-100 * row['difference']:.1f}", f"{100 * row['half_width']:.1f}"
    assert said("README.md", r"takes (\d\.\d) % ± (\d\.\d) off") == measured
    page = r"seven scenes the oracle takes (\d\.\d) % ± (\d\.\d) off hard"
    assert said("docs/exploration-ceiling/README.md", page) == measured


def test_the_page_of_results_counts_the_runs_that_there_are() -> None:
    (total,) = said("docs/results.md", r"(\d+) of the runs of `make report`")
    counts = said(
        "docs/small/README.md", r"three seeds, (\d+) runs, plus (\d+) of .+? and (\d+) of"
    )
    assert int(total) == sum(map(int, counts))
    effect = said("docs/results.md", r"the difference is (\+0\.\d %) \((−\d\.\d) to (\+\d\.\d)\)")
    assert effect == said(
        "docs/small/README.md", r"\*\*(\+0\.\d %) \((−\d\.\d) to (\+\d\.\d)\)\*\*"
    )
    (steps,) = said("docs/results.md", r"Scoring them costs (\d) % of the steps")
    assert (steps,) == said("docs/small/README.md", r"\*Scoring\* takes (\d) % of the steps")


def test_the_page_of_results_says_of_the_map_what_the_map_says() -> None:
    folder = ROOT / "docs" / "exploration-map"
    evaluations = pd.read_csv(folder / "exploration_map.csv.gz")
    setting = list(evaluations.loc[:, "volume":"seed"])
    (runs,) = said("docs/results.md", r"The map, ([\d,]+) runs")
    assert int(runs.replace(",", "")) == len(evaluations[setting].drop_duplicates())
    speedups = pd.read_csv(folder / "speedups.csv")
    base = speedups.query(
        "volume == 0.01 and dimensions == 8 and active == 4 and pockets == 1 and sharpness == 0 "
        "and noise == 0 and hidden_features == 64 and cost_ratio == 10 and sampler == 'loss_greedy'"
    ).set_index(["error", "reuse"])["speedup"]
    new, reused = said(
        "docs/results.md", r"in (a \w+) of the time with every batch new, in (a \w+) with self-"
    )
    assert 1 / base["error_tail", False] <= FRACTIONS[new]
    assert 1 / base["error_tail", True] <= FRACTIONS[reused]
    low, high = said("docs/results.md", r"For the \*mean\* error it takes (\d) to (\d) times")
    slower = sorted(round(1 / base["error_uniform", reuse]) for reuse in (True, False))
    assert slower == [int(low), int(high)]


def test_the_map_says_of_its_base_what_its_ratios_say() -> None:
    speedups = pd.read_csv(ROOT / "docs/exploration-map/speedups.csv")
    base = at_base(speedups[speedups["sampler"] == "loss_greedy"], set())
    base = base.set_index(["error", "reuse"])

    def shown(error: str, reuse: bool) -> str:
        ratio, *interval = (
            f"{number:.2f}" if number < 1 else f"{number:.1f}"
            for number in base.loc[(error, reuse), ["speedup", "low", "high"]]
        )
        return f"{ratio} ({' to '.join(interval)})"

    interval = r"(\d\.\d+ \(\d\.\d+ to \d\.\d+\))"
    page = "docs/exploration-map/README.md"
    assert said(page, rf"every batch new \| ≥ 9.2 \| .+? \| {interval}") == (
        shown("error_uniform", False),
    )
    assert said(page, rf"self-tuning reuse \| {interval} \| .+? \| {interval}") == (
        shown("error_tail", True),
        shown("error_uniform", True),
    )


def test_the_readme_says_of_dear_patches_what_their_runs_say() -> None:
    folder = ROOT / "docs" / "exploration-ceiling"
    last = pd.read_csv(folder / "scarce_chains.csv").groupby(["method", "scene", "seed"]).last()
    error = geometric_mean(last, "hard")
    ways = (error[f"ours_{way}"].to_dict() for way in ("uniform", "exploring"))
    chains = paired_difference(*ways)
    assert chains is not None
    assert chains.half_width is not None
    measured = f"{100 * chains.mean:.1f}", f"{100 * chains.half_width:.1f}", str(chains.n)
    assert said("README.md", r"\[(\d\.\d) % ± (\d\.\d) more\].*?\((\d+) pairs") == measured


def test_what_is_said_of_the_rare_is_what_its_runs_say() -> None:
    runs = pd.read_csv(ROOT / "docs/exploration-ceiling/rare.csv")
    last = runs[runs["step"] == 3000].set_index(["method", "seed"])
    error = geometric_mean(last, "hard")
    figures = []
    for method in ("ours_eager", "ours_exploring"):
        difference = paired_difference(error["ours"].to_dict(), error[method].to_dict())
        assert difference is not None
        assert difference.half_width is not None
        assert difference.n == 3
        figures += [f"{-100 * difference.mean:.0f}", f"{100 * difference.half_width:.0f}"]
    percent = r"(\d+) % ± (\d+)"
    with_light = rf"ends with {percent} less error on frames with the light"
    pattern = rf"{with_light}.+?chains with {percent} less"
    for page in ("README.md", "docs/results.md"):
        assert said(page, pattern) == tuple(figures)
    lit = (last["lit_patches"] / last["patches_traced"]).groupby("method").mean()
    page, pattern = "docs/exploration-ceiling/rare.md", r"in (\d+) % of its.+?in (\d+) % of theirs"
    shares = said(page, pattern)
    assert shares == (f"{100 * lit['ours']:.0f}", f"{100 * lit['ours_exploring']:.0f}")
