"""The page: it holds everything itself, escapes what it shows, and its numbers are the runs'."""

import base64
import math
import re
from dataclasses import dataclass
from html.parser import HTMLParser
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from analysis.methods import title
from analysis.page.images import LARGEST_PICTURE, from_picture
from analysis.report import main
from analysis.runs import find_runs
from analysis.verdicts import judge

VOID = {"meta", "img", "br", "hr", "line", "link", "input"}


class Page(HTMLParser):
    """A page taken apart: elements with their attributes, tables as frames, and all text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.html = html
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.tables: dict[str, pd.DataFrame] = {}
        self.text = ""
        self._open: list[str] = []
        self._rows: list[list[str]] = []
        self._caption = ""
        self.feed(html)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag == "table":
            self._rows, self._caption = [], ""
        elif tag == "tr":
            self._rows.append([])
        elif tag in ("td", "th"):
            self._rows[-1].append("")
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag in VOID:
            return
        assert self._open.pop() == tag
        if tag == "table":
            # Rows of the table of claims that a claim's cell spans have one cell fewer.
            width = len(self._rows[0])
            rows = [[""] * (width - len(row)) + row for row in self._rows[1:]]
            self.tables[self._caption] = pd.DataFrame(rows, columns=self._rows[0])

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] == "style":
            return
        self.text += data
        if "caption" in self._open:
            self._caption += data.strip()
        elif {"td", "th"} & set(self._open):
            self._rows[-1][-1] += data.strip("\n")

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]

    def headings(self) -> list[int]:
        return [int(name[1]) for name, _ in self.elements if re.fullmatch("h[1-6]", name)]


def page_of(folder: Path, output: Path) -> Page:
    assert main([str(folder), "--output", str(output)]) == 0
    return Page((output / "index.html").read_text())


@dataclass(frozen=True)
class Reported:
    """A folder of runs, what the report wrote, and its page."""

    runs: Path
    output: Path
    page: Page


@pytest.fixture(scope="module")
def claims(makers_below, tmp_path_factory) -> Reported:
    """Two claims are tested: one is right for these runs, one is not."""
    folder = tmp_path_factory.mktemp("claims")
    _, make_method = makers_below(folder / "runs")
    for seed in range(3):
        make_method("uniform", seed=seed, error=0.2)
        make_method("active_exploration", seed=seed, error=0.1, rate=0.02)
        make_method("no_preconditioning", seed=seed, error=0.2)
        make_method("constant_resolution", seed=seed, error=0.07)
        make_method("uniform_growing", seed=seed, error=0.1)
        make_method("uniform", scene="salon-5", seed=seed, error=0.11)
        make_method("active_exploration", scene="salon-5", seed=seed, error=0.1)
    return Reported(folder / "runs", folder, page_of(folder / "runs", folder))


@pytest.fixture(scope="module")
def plain(makers_below, tmp_path_factory) -> Reported:
    """Runs that test no claim."""
    folder = tmp_path_factory.mktemp("plain")
    make_run, _ = makers_below(folder / "runs")
    for seed in range(2):
        make_run(seed=seed)
        make_run(seed=seed, sampler="mcmc_loss_step", quality=1.3)
    return Reported(folder / "runs", folder, page_of(folder / "runs", folder))


def test_page_needs_nothing_else(claims) -> None:
    ids = {attributes["id"] for _, attributes in claims.page.elements if "id" in attributes}
    for tag, attributes in claims.page.elements:
        assert tag not in ("script", "link", "iframe", "object", "base", "form")
        assert not [name for name in attributes if name.startswith("on")]
        assert {"srcset", "action", "poster"}.isdisjoint(attributes)
        if "src" in attributes:
            assert attributes["src"].startswith("data:image/")
        if "href" in attributes:
            href = attributes["href"]
            assert href[1:] in ids if href[0] == "#" else href.startswith("https://doi.org/")
    assert "@import" not in claims.page.html
    assert "url(" not in claims.page.html


def test_page_can_be_read_without_seeing_it(claims) -> None:
    assert claims.page.all("html")[0]["lang"] == "en"
    assert "width=device-width" in claims.page.all("meta")[1]["content"]
    assert claims.page.headings()[0] == 1
    assert all(below - above <= 1 for above, below in pairwise(claims.page.headings()))
    images = claims.page.all("img")
    assert len(images) > 20
    assert all(len(image["alt"]) > 10 and int(image["width"]) > 0 for image in images)
    assert len(claims.page.all("table")) == len(claims.page.all("caption"))
    assert all(cell["scope"] in ("col", "row", "rowgroup") for cell in claims.page.all("th"))
    ids = [attributes["id"] for _, attributes in claims.page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))


def test_claims_are_told_in_words_with_their_evidence(claims) -> None:
    results = {result.claim.id: result for result in judge(find_runs(claims.runs)[0])}
    preconditioning, resolution = results["preconditioning"], results["resolution"]
    assert (preconditioning.verdict, resolution.verdict) == ("reproduced", "not reproduced")
    for result in (preconditioning, resolution):
        for text in (result.claim.statement, result.claim.source, result.sentence):
            assert text in claims.page.text
    table = claims.page.tables["What the paper claims, and what these runs show"]
    row = table[table["claim"].str.startswith("Position preconditioning")].iloc[0]
    effect = preconditioning.comparisons[0].decisive
    assert row["difference"] == (
        f"{effect.effect_percent:+.1f} % [{effect.low:+.1f}, {effect.high:+.1f}]"
    )
    assert effect.effect_percent == pytest.approx(-50, abs=3)
    assert row["verdict"] == "✓ reproduced"
    assert row["seeds"] == "3"
    assert "1 reproduced" in claims.page.text
    assert "1 not reproduced" in claims.page.text
    assert "make report SWEEPS=acceptance" in claims.page.text


def test_a_claims_table_has_its_own_methods_only(claims) -> None:
    section = claims.page.html.split('id="claim-preconditioning"')[1].split("</section>")[0]
    assert "Active Exploration" in section
    assert "no position preconditioning" in section
    assert "uniform sampling" not in section


def test_every_error_is_the_mean_of_the_runs_errors(claims) -> None:
    runs = pd.DataFrame(
        {
            "scene": run.scene,
            "method": title(run.label["method"]),
            **{
                metric.upper(): run.result["metrics"]["hard"][metric]["mean"]
                for metric in ("mape", "dssim", "mae", "lpips")
            },
        }
        for run in find_runs(claims.runs)[0]
    )
    expected = runs.groupby(["scene", "method"]).mean()
    shown = claims.page.tables["Error on hard frames, mean"]
    shown = shown[shown["method"] != "reference noise"].set_index(["scene", "method"])
    assert set(shown.index) == set(expected.index)
    for metric in expected:
        means = shown[metric].str.split(" ± ").str[0].astype(float)
        np.testing.assert_allclose(means[expected.index], expected[metric], rtol=0.005)


def test_the_same_runs_make_the_same_files(plain, tmp_path) -> None:
    page_of(plain.runs, tmp_path)
    again = {file.relative_to(tmp_path) for file in tmp_path.rglob("*") if file.is_file()}
    assert len(again) > 10
    for file in again:
        assert (tmp_path / file).read_bytes() == (plain.output / file).read_bytes(), file


@pytest.mark.usefixtures("undrawn")
def test_relmse_has_a_curve_where_it_was_measured(make_run, tmp_path) -> None:
    folder = make_run(change=lambda result: result.update(relmse={"hard": 0.0125, "uniform": 0.5}))
    table = pd.read_csv(folder / "metrics.csv")
    table.assign(hard_relmse=0.0125, uniform_relmse=0.5).to_csv(folder / "metrics.csv", index=False)
    page = page_of(tmp_path / "runs", tmp_path / "report")
    alts = [str(image["alt"]) for image in page.all("img")]
    (hard,) = {alt for alt in alts if alt.startswith("noise-free relMSE on hard")}
    assert hard.startswith("noise-free relMSE on hard frames of mirror against run time; at the")
    assert hard.endswith("0.0125")
    (uniform,) = {alt for alt in alts if alt.startswith("noise-free relMSE on uniform")}
    assert float(uniform.rpartition(" ")[2]) == 0.5


@pytest.mark.usefixtures("undrawn")
def test_what_it_shows_is_escaped(make_run, tmp_path) -> None:
    name = '<img src=x onerror="alert(1)">&amp;'
    make_run(sampler=name)
    page = page_of(tmp_path / "runs", tmp_path / "report")
    assert name in page.text
    assert all(image["src"].startswith("data:") for image in page.all("img"))
    assert any(name in image["alt"] for image in page.all("img"))


HOSTILE = "<script>alert(1)<!--\"><img src=x onerror=alert(2)>'&amp;{{ 7 * 7 }}$\\frac{"
"""Could be the name of a folder too; the dollar begins a formula for matplotlib."""


def test_hostile_names_are_shown_as_they_are_everywhere(make_run, make_method, tmp_path) -> None:
    def spoil(result: dict) -> None:
        for key in ("commit", "lpips_note", "scene_hash", "reference_hash", "identity"):
            result[key] = HOSTILE
        result["protocol"]["name"] = result["protocol"]["identity"] = HOSTILE
        result["machine"] = {"cpu": HOSTILE, "gpu": HOSTILE, HOSTILE: HOSTILE}
        result["versions"] = {"torch": HOSTILE, HOSTILE: HOSTILE}
        result["backend"] = HOSTILE
        result["config"] = {HOSTILE: HOSTILE}
        for key in ("experiment", "budget", "model", "loss", "resolution"):
            result["label"][key] = HOSTILE

    make_run(seed=3, scene=HOSTILE, sampler=HOSTILE, lpips=False, change=spoil)
    make_method(HOSTILE, scene=HOSTILE, lpips=False, change=spoil)
    make_method("uniform", seed=1, scene=HOSTILE, change=spoil)
    folder = make_run(seed=2, scene=f"damaged {HOSTILE}")
    (folder / "result.json").write_text(f'{{"{HOSTILE}"')
    root = (tmp_path / "runs").rename(tmp_path / HOSTILE)
    page = page_of(root, tmp_path / "report")
    for tag, attributes in page.elements:
        assert tag not in ("script", "iframe", "object", "form")
        assert not [name for name in attributes if name.startswith("on")]
        assert (attributes.get("src") or "data:").startswith("data:")
    assert "{{ 7 * 7 }}" in page.text
    assert page.text.count(HOSTILE) > 5
    for image in page.all("img"):
        assert image["alt"]
        if image["src"].startswith("data:image/svg"):
            svg = base64.b64decode(image["src"].partition(",")[2])
            assert b"<script" not in svg
            assert b"onerror=" not in re.sub(rb">[^<]*<", b"><", svg)


def test_runs_that_test_no_claim_make_a_page_too(plain) -> None:
    page = plain.page
    assert "They test none of the paper's claims" in page.text
    ids = {attributes["id"] for _, attributes in page.elements if "id" in attributes}
    assert {"errors", "curves", "pictures", "costs", "provenance"} <= ids
    assert not ids & {"claims", "dimensions"}
    assert not (plain.output / "dimensions.png").exists()
    (row,) = page.tables["Run time to equal error"].to_dict("records")
    assert (row["method"], row["baseline"]) == ("mcmc_loss_step", "uniform sampling")


@pytest.mark.usefixtures("undrawn")
def test_what_runs_lack_leaves_the_rest_of_the_page(make_run, tmp_path) -> None:
    def spoil(result: dict) -> None:
        result["metrics"]["hard"]["mape"]["mean"] = math.nan
        for frame in result["frames"]:
            frame["mape"] = math.nan

    folder = make_run(lpips=False)
    (folder / "pictures" / "hard_00_error.png").unlink()
    make_run(lpips=False, sampler="mcmc_loss", method="active_exploration", change=spoil)
    page = page_of(tmp_path / "runs", tmp_path / "report")
    errors = page.tables["Error on hard frames, mean"].set_index("method")
    assert errors.loc["Active Exploration", "MAPE"] == "nan"
    assert errors.loc["uniform sampling", "LPIPS"] == "–"
    assert "LPIPS is empty" in page.text
    assert "There are no pictures of this scene" in page.text
    assert "no comparison pictures of mirror" in page.text


def test_pictures_are_those_of_the_runs(plain) -> None:
    pictures = {image["alt"]: image["src"] for image in plain.page.all("img")}
    # The fixture's frame 3 is where the methods differ most.
    assert next(alt for alt in pictures if "frame" in alt and "reference" in alt).startswith(
        "reference, hard frame 3"
    )
    for kind, alt in (
        ("reference", "reference, hard frame 3 of mirror"),
        ("prediction", "prediction of uniform sampling, hard frame 3 of mirror"),
        ("error", "error map of uniform sampling, hard frame 3 of mirror"),
    ):
        data = base64.b64decode(pictures[alt].removeprefix("data:image/webp;base64,"))
        with Image.open(BytesIO(data)) as shown:
            values = np.asarray(shown.convert("RGB"), dtype=float)
        file = plain.runs / "mirror" / "uniform" / "seed=0" / "pictures" / f"hard_03_{kind}.png"
        with Image.open(file) as source:
            expected = np.asarray(source.convert("RGB"), dtype=float)
        assert values.shape == expected.shape
        assert np.abs(values - expected).mean() < 12  # noise per pixel; another frame has 30


def test_large_pictures_are_shrunk() -> None:
    shown = from_picture(Image.new("RGB", (900, 600), "red"), "a red picture")
    assert (shown.width, shown.height) == (LARGEST_PICTURE, round(LARGEST_PICTURE * 2 / 3))
    data = base64.b64decode(shown.uri.removeprefix("data:image/webp;base64,"))
    with Image.open(BytesIO(data)) as image:
        assert image.size == (shown.width, shown.height)


def test_curves_are_svg_with_a_logarithmic_axis_of_errors(plain) -> None:
    (figure,) = (
        image
        for image in plain.page.all("img")
        if image["alt"].startswith("DSSIM on uniform frames")
    )
    svg = base64.b64decode(figure["src"].removeprefix("data:image/svg+xml;base64,")).decode()
    ticks = [float(text) for text in re.findall(r">([0-9.]+)</text>", svg)]
    errors = sorted(tick for tick in ticks if 0 < tick < 1)
    assert len(errors) >= 2
    mantissas = {round(tick / 10 ** math.floor(math.log10(tick))) for tick in errors}
    assert mantissas <= {1, 2, 5}
    assert "<script" not in svg
