from dataclasses import replace

from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.tables import markdown, table

PATCH = figure("patch", [1.0, 2.0, 3.0], "ms", "≤ 4")
FIGURES = [
    replace(PATCH, part="speed", scene="mirror"),
    replace(figure("paths", [12345.0], ""), part="speed", scene="mirror"),
    replace(PATCH, part="speed", scene="salon"),
    replace(figure("step", [0.25], "s"), part="training"),
]


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_the_list_has_a_heading_per_part_and_a_line_per_figure() -> None:
    heading, first, second, _, blank, other, last = table(FIGURES).splitlines()
    assert (heading, blank, other) == ("speed", "", "training")
    assert first.split() == ["mirror:", "patch", "2", "ms", "(1", "–", "3)", "wanted", "≤", "4"]
    assert second.split() == ["mirror:", "paths", "12,345"]
    assert last.split() == ["step", "0.25", "s"]


def test_in_markdown_a_scene_is_a_row_and_what_was_not_measured_is_a_dash() -> None:
    lines = markdown(FIGURES).splitlines()
    assert lines[0] == "### speed"
    assert cells(lines[2]) == ["scene", "patch, ms, wanted ≤ 4", "paths"]
    assert cells(lines[4]) == ["mirror", "2 (1 – 3)", "12,345"]
    assert cells(lines[5]) == ["salon", "2 (1 – 3)", "–"]


def test_in_markdown_what_has_no_scene_is_a_row_itself() -> None:
    lines = markdown(FIGURES).split("### training")[1].splitlines()
    assert cells(lines[-1]) == ["step", "0.25 s", ""]


def test_parts_that_come_in_turns_make_one_table_each() -> None:
    turns = [
        Figure("x", 1, 1, 1, "", part=part, scene=scene) for scene in "ab" for part in ("p", "q")
    ]
    assert markdown(turns).count("###") == 2


def test_in_markdown_no_figure_hides_another_one_of_its_part() -> None:
    one = Figure("step", 7, 7, 7, "ms", part="p", scene="salon")
    figures = [one, replace(one, median=50, lower=50, upper=50, unit="%"), replace(one, scene="")]
    text = markdown(figures)
    assert cells(text.splitlines()[4]) == ["salon", "7", "50"]
    assert cells(text.splitlines()[-1]) == ["step", "7 ms", ""]
    assert text.count("###") == 1
