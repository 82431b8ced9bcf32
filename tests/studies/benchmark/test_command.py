import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ngi.studies.benchmark import __main__ as command
from ngi.studies.benchmark import parts
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.measures import MEASURES
from ngi.studies.benchmark.part import Options, Part, per_scene
from ngi.studies.benchmark.scenes import one_per_folder


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[Options]:
    """What the only two parts there are were asked for: one that renders, one that does not."""
    asked: list[Options] = []

    def note(options: Options) -> Iterator[Figure]:
        asked.append(options)
        yield figure("speed", [1.0, 2.0, 3.0], "m/s")

    monkeypatch.setattr(
        parts,
        "PARTS",
        (Part("render", "", per_scene_of(note), scenes=None), Part("learn", "", note)),
    )
    return asked


def per_scene_of(note: Callable[[Options], Iterator[Figure]]):
    return per_scene(lambda _, options: note(options))


def test_figures_are_written_and_printed_by_part_and_scene(
    tmp_path: Path, measured: list[Options], capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "folder" / "benchmark.json"
    options = ["scenes=[mirror,cornell-box]", "markdown=true", f"output={output}"]
    assert command.main(options) == 0
    report = json.loads(output.read_text())
    assert [(f["part"], f["scene"]) for f in report["figures"]] == [
        ("render", "mirror"),
        ("render", "cornell-box"),
        ("learn", ""),
    ]
    assert report["figures"][0]["median"] == 2
    assert "mitsuba" in report["versions"]
    printed = capsys.readouterr().out
    assert "mirror: speed" in printed
    assert "| cornell-box | 2 (1 – 3) |" in printed
    assert "left out" not in printed
    assert len(measured) == 3


def test_by_default_few_scenes_are_rendered_and_the_others_named(
    tmp_path: Path, measured: list[Options], capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main([f"output={tmp_path / 'x.json'}"]) == 0
    assert [scene.name for scene in measured[0].scenes] == list(command.SHORT)
    left_out = capsys.readouterr().out.splitlines()[0]
    assert all(name in left_out for name in {*one_per_folder()} - {*command.SHORT})


def test_a_part_by_itself_renders_every_scene(tmp_path: Path, measured: list[Options]) -> None:
    assert command.main(["render", f"output={tmp_path / 'x.json'}"]) == 0
    assert [scene.name for scene in measured[0].scenes] == one_per_folder()


def test_what_was_measured_before_an_error_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_: Options) -> Iterator[Figure]:
        yield figure("first", [1.0], "s")
        raise RuntimeError("out of paths")

    monkeypatch.setattr(parts, "PARTS", (Part("fail", "", fail),))
    assert command.main([f"output={tmp_path / 'x.json'}"]) == 2
    assert capsys.readouterr().err == "out of paths\n"
    assert [f["name"] for f in json.loads((tmp_path / "x.json").read_text())["figures"]] == [
        "first"
    ]


def test_what_was_measured_before_stays_where_nothing_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: Options) -> Iterator[Figure]:
        raise RuntimeError("out of paths")
        yield

    monkeypatch.setattr(parts, "PARTS", (Part("fail", "", fail),))
    file = tmp_path / "x.json"
    file.write_text("figures of yesterday")
    assert command.main([f"output={file}"]) == 2
    assert file.read_text() == "figures of yesterday"


@pytest.mark.parametrize(
    ("given", "default", "expected"),
    [(None, 16, 16), (None, None, None), (4, 16, 4), ("training", 16, None)],
)
def test_samples_per_pixel(given, default, expected) -> None:
    options = Options([], samples_per_pixel=given, repeats=1, seconds=1, patches=None)
    assert options.samples(default) == expected


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["speed"], "no part speed; there are compilations, frames, inference"),
        (["scenes=[moon]"], "no scene moon; there are archviz"),
        (["release=[nowhere]"], "nowhere: no scene.xml is there"),
        (["repeats=0"], "repeats: 0 is not positive"),
        (["samples_per_pixel=many"], "samples_per_pixel: 'many' is neither"),
        (["samples_per_pixel=0"], "samples_per_pixel: '0' is neither"),
    ],
)
def test_bad_options(options, message, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(options) == 2
    assert message in capsys.readouterr().err


def test_every_part_that_is_listed_is_measured() -> None:
    assert [part.name for part in parts.PARTS] == list(MEASURES)


def test_help_names_every_part(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        command.main(["--help"])
    printed = capsys.readouterr().out
    assert all(f"{part.name} " in printed and part.help in printed for part in parts.PARTS)
