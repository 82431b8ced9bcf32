import json
from pathlib import Path

import pytest

from ngi.backend import llvm_problem
from ngi.benchmark import __main__ as command
from ngi.benchmark import figures, training
from ngi.models import PixelGenerator
from ngi.patches import BufferLayout


def test_a_ratio_compares_neighbours_in_time() -> None:
    assert figures.ratio([2.0, 9.0], [1.0, 3.0]) == [2.0, 3.0]
    figure = figures.figure("x", [4.0, 1.0, 2.0, 3.0, 5.0], "s")
    assert figure.median == 3
    assert figure.lower < 3 < figure.upper


def test_functions_take_turns() -> None:
    calls: list[str] = []
    seconds = figures.in_turn(2, "", lambda: calls.append("a"), lambda: calls.append("b"))
    assert calls == ["a", "b", "a", "b", "a", "b"]
    assert [len(s) for s in seconds] == [2, 2]


def test_operations_are_those_that_pytorch_counts() -> None:
    from torch.utils.flop_counter import FlopCounterMode

    layout = BufferLayout()
    network = PixelGenerator(layout=layout, scene_dimensions=3, hidden_features=64, hidden_layers=4)
    patches = training.random_patches(layout, 3)
    with FlopCounterMode(display=False) as counter:
        network(patches.buffers, patches.scene_vector).sum().backward()
    ours = training.training_operations(network)
    assert ours == pytest.approx(counter.get_total_flops(), rel=0.02)


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
def test_the_benchmark_runs_and_writes_its_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "NETWORKS", ((16, 3, False),))
    monkeypatch.setattr(command, "STORED_PATCHES", 32)
    output = tmp_path / "benchmark.json"
    options = [
        "--repeats",
        "2",
        "--scenes",
        "sphere-caustic",
        "--samples-per-pixel",
        "1",
        "--output",
    ]
    assert command.main([*options, str(output)]) == 0
    measured = {f["name"]: f for f in json.loads(output.read_text())["figures"]}
    assert measured["kernels compiled after warm-up (sphere-caustic, 1 spp)"]["median"] == 0
    assert all(f["median"] > 0 for f in measured.values() if "kernels" not in f["name"])
    printed = capsys.readouterr().out
    assert all(name in printed for name in measured)


@pytest.mark.parametrize(
    ("options", "message"), [(["speed"], "no part speed"), (["--scenes", "moon"], "no scene moon")]
)
def test_unknown_parts_and_scenes(options, message, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        command.main(options)
    assert message in capsys.readouterr().err
