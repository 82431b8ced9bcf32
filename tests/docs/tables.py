"""Tables and differences as pages have them."""

from pathlib import Path

import pandas as pd

from analysis.statistics import Estimate, difference_over_scenes, paired_difference
from tests.docs.pages import ROOT


def rows_of(page: str, section: str) -> list[list[str]]:
    """Cells of the tables in a section, bold or not, without the first of each row."""
    text = (ROOT / page).read_text().split(f"## {section}")[1].split("\n## ")[0]
    lines = [line.replace("*", "") for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.split("|")[2:-1]] for line in lines]


def ends_of(file: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The last evaluations of uniform sampling and of small patches, by scene and seed."""
    runs = pd.read_csv(file)
    last = runs.groupby(["scene", "seed", "method"]).tail(1).set_index(["scene", "seed"])
    uniform, small = (last[last.method == f"ours_{name}"] for name in ("uniform", "small_patches"))
    return uniform.sort_index(), small.sort_index()


def tenths(change: float) -> str:
    return f"{100 * change:+.1f}".replace("-", "−")


def percent(number: float) -> str:
    """Without decimals, as pages have it."""
    rounded = round(number)
    return "0" if rounded == 0 else f"{rounded:+d}".replace("-", "−")


def difference_of(base: pd.Series, other: pd.Series) -> Estimate:
    """Of `other` to `base`, paired by their index."""
    difference = paired_difference(base.to_dict(), other.to_dict())
    assert difference is not None
    return difference


def over_scenes(base: pd.Series, other: pd.Series) -> Estimate:
    """The same, of which every scene is one value; indexed by scene and seed."""
    difference = difference_over_scenes(base.to_dict(), other.to_dict())
    assert difference is not None
    return difference


def estimate_of(row: pd.Series) -> Estimate:
    """Of a row of `differences`."""
    return Estimate(row["difference"], row["half_width"], row["n"])


def as_shown(difference: Estimate) -> str:
    """As the tables have it: '+3.0 ± 1.1 % (21)', and without ± where there is one pair."""
    interval = "" if difference.half_width is None else f" ± {100 * difference.half_width:.1f}"
    mean = f"{100 * difference.mean:+.1f}".replace("-0.0", "0.0")
    text = f"{mean}{interval} % ({difference.n})"
    return text.replace("-", "−")


def in_words(difference: Estimate, sign: str = "") -> str:
    """'1.2 % ± 2.3', as sentences have it."""
    assert difference.half_width is not None
    return f"{100 * abs(difference.mean):{sign}.1f} % ± {100 * difference.half_width:.1f}"
