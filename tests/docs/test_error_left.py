"""What the page of the learner says of where its error is left is what was measured."""

import pandas as pd

from ngi.files.resources import root
from tests.docs.tables import rows_of, tenths

PAGE, SECTION = "docs/learner/README.md", "Where the error is left"
COLUMNS = [f"{frames}_{of}" for frames in ("hard", "uniform") for of in ("error", "mae", "tail")]
ONCE, ALONE = "1x, 16 rays", "alone without direct light"
IMAGES = ("2x at edges, 16 rays", "2x, 16 rays", "2x, 4 rays", "1x, 64 rays")
SCENES = ("living-room", "bathroom")


def shown(changes: pd.Series) -> str:
    return ", ".join(map(tenths, changes - 1)).replace("−0.0", "0.0").replace("+0.0", "0.0")


def test_what_emission_and_more_questions_at_edges_are_worth() -> None:
    runs = pd.read_csv(root() / "docs/learner/edges.csv")
    rows = iter(rows_of(PAGE, SECTION)[7:])
    once = runs.query("image == @ONCE").set_index(["scene", "emission", "seed"])[COLUMNS]
    assert next(rows)[0] == "hard frames: error"
    next(rows)
    for scene in SCENES:
        changes = once.loc[scene, "emission as radiance"] / once.loc[scene, "emitters alone"]
        assert next(rows) == [shown(changes.dropna()[column]) for column in COLUMNS]
    one = runs.query("emission == @ALONE and seed == 1").set_index(["scene", "image"])[COLUMNS]
    assert next(rows)[0] == "hard frames: error"
    next(rows)
    for scene in SCENES:
        for image in IMAGES:
            changes = one.loc[scene, image] / one.loc[scene, ONCE]
            assert next(rows) == [shown(changes[[column]]) for column in COLUMNS]


def test_which_pixels_hold_the_error() -> None:
    shares = pd.read_csv(root() / "docs/learner/edge_shares.csv").set_index(["set", "pixels"])
    kinds = ("emitter", "edge", "shadow", "specular", "rest")
    for kind, row in zip(kinds, rows_of(PAGE, SECTION)[2:7], strict=True):
        for cell, column in zip(row, shares.columns, strict=True):
            each = [100 * shares.loc[(frames, kind), column] for frames in ("hard", "uniform")]
            digits = 1 if max(each) < 0.5 else 0
            assert cell == " / ".join(f"{share:.{digits}f}" for share in each) + " %"


SUPERSAMPLED = "Supersampled edges"
SHOWN = ("error", "mape", "dssim", "mae", "lpips", "tail")


def test_what_supersampled_edges_are_worth() -> None:
    runs = pd.read_csv(root() / "docs/learner/supersampled.csv")
    of = runs.set_index(["supersampled_edges", "scene"])
    changes = of.loc[True] / of.loc[False]
    rows = iter(rows_of(PAGE, SUPERSAMPLED)[2:])
    for scene in ("living-room", "sphere-caustic", "veach-egg"):
        columns = [[f"{frames}_{metric}" for frames in ("hard", "uniform")] for metric in SHOWN]
        expected = [" / ".join(shown(changes.loc[scene, [c]]) for c in pair) for pair in columns]
        assert next(rows) == expected


def test_which_edges_and_how_many_rays_a_quarter_needs() -> None:
    runs = pd.read_csv(root() / "docs/learner/quarters.csv")
    masks = runs.sort_values("share").query("scene == 'living-room'")["edges"].unique()
    runs = runs.set_index(["edges", "rays_per_quarter", "scene"])
    columns = [
        f"{frames}_{of}_change_percent"
        for frames in ("hard", "uniform")
        for of in ("error", "tail")
    ]
    rows = iter(rows_of(PAGE, SUPERSAMPLED)[7:])
    for edges, rays in [*((mask, 16) for mask in masks), (masks[-1], 8), (masks[-1], 4)]:
        row = next(rows)
        assert row[0] == str(rays)
        for cell, scene in zip(row[1:], (*SCENES, "sphere-caustic"), strict=True):
            run = runs.loc[(edges, rays, scene)]
            pairs = columns[:2], columns[2:]
            expected = " / ".join(shown(1 + run[pair] / 100) for pair in pairs)
            assert cell == f"{100 * run.share:.0f} %: {expected}"
