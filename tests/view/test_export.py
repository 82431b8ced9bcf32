"""`ngi export` on runs of closed formulas; ONNX Runtime is the independent judge."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from ngi.files.extras import install_command
from ngi.files.resources import root
from ngi.learn.supersampling import LEAST
from ngi.machine.precision import multiplies_bfloat16
from ngi.models import EncodedGenerator, LinearEmissionGenerator, PixelGenerator
from ngi.models.known_light import add_known_light
from ngi.patches import BUFFER_CHANNELS, CHAIN_CHANNELS, DIRECT_CHANNELS, BufferLayout
from ngi.scene import read_scene, scenes
from ngi.view import export
from ngi.view.network_file import (
    BUFFERS,
    KNOWN_LIGHT,
    known_light,
    largest_difference,
    network_file,
    scene_metadata,
)
from ngi.view.trained_run import TrainedRun
from tests.learn.command_line import run

onnx = pytest.importorskip("onnx", reason="the extra 'export' is missing")
onnxruntime = pytest.importorskip("onnxruntime", reason="the extra 'export' is missing")

EMBEDDER = """
import json, sys
sys.modules["ngi"] = sys.modules["torch"] = None
import numpy, onnxruntime
session = onnxruntime.InferenceSession("network.onnx")
given = numpy.load("inputs.npz")
for name in ("one", "many"):
    inputs = {"buffers": given[name], "v": given["v"]}
    numpy.save(name, session.run(["radiance"], inputs)[0])
print(json.dumps(session.get_modelmeta().custom_metadata_map))
"""


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("trained")
    status, output = run(folder, "run.folder=run")
    assert status == 0, output
    return folder


@pytest.fixture(scope="module")
def exported(trained: Path) -> Path:
    arguments = [f"run={trained / 'run'}", f"out={trained / 'network.onnx'}"]
    assert export.main(arguments) == 0
    return trained / "network.onnx"


@pytest.fixture(scope="module")
def opened(trained: Path) -> TrainedRun:
    return TrainedRun.open(trained / "run")


@pytest.fixture(scope="module")
def embedded(exported: Path, opened: TrainedRun) -> dict[str, Any]:
    """What a program that knows neither ngi nor PyTorch makes of the file."""
    generator = torch.Generator().manual_seed(1)
    C, D = opened.renderer.layout.channels, opened.renderer.dimensions
    inputs = {
        "one": torch.rand(1, C, generator=generator),
        "many": 4 * torch.rand(777, C, generator=generator) - 2,
        "v": torch.rand(D, generator=generator),
    }
    np.savez(exported.parent / "inputs.npz", **{k: x.numpy() for k, x in inputs.items()})
    done = subprocess.run(
        [sys.executable, "-I", "-c", EMBEDDER],
        capture_output=True,
        text=True,
        cwd=exported.parent,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    outputs = {name: np.load(exported.parent / f"{name}.npy") for name in ("one", "many")}
    return {"inputs": inputs, "outputs": outputs, "metadata": json.loads(done.stdout)}


@pytest.mark.parametrize("name", ["one", "many"])
def test_a_program_without_this_one_gets_linear_radiance(
    embedded: dict[str, Any], opened: TrainedRun, name: str
) -> None:
    buffers, v = embedded["inputs"][name], embedded["inputs"]["v"]
    network = PixelGenerator(
        layout=opened.network.layout,
        scene_dimensions=len(v),
        hidden_features=opened.network.input_layer.out_features,
        hidden_layers=len(opened.network.hidden) + 1,
    ).double()
    network.load_state_dict(opened.network.state_dict())
    with torch.no_grad():
        log_radiance = network(buffers[None, None].double(), v[None].double())[0, 0]
    expected = log_radiance.exp() - 1
    np.testing.assert_allclose(embedded["outputs"][name], expected, rtol=1e-5, atol=1e-5)
    assert name == "one" or (expected < 0).any()


def test_the_file_is_one_that_runtimes_of_2023_read(exported: Path) -> None:
    model = onnx.load(exported)
    onnx.checker.check_model(model, full_check=True)
    [operators] = model.opset_import
    # In ONNX's table of versions these belong together, and to ONNX Runtime 1.14.
    assert (operators.domain, operators.version, model.ir_version) == ("", 18, 8)


def test_the_file_says_what_its_inputs_are(
    embedded: dict[str, Any], opened: TrainedRun, trained: Path
) -> None:
    told = embedded["metadata"]
    settings = json.loads((trained / "run" / "settings.json").read_text())
    assert {"name": told["scene"], "hash": told["scene_hash"]} == settings["scene"]
    assert told["step"] == "12" == str(opened.step)
    assert told["precision"] == "float32; trained as 32-true"
    assert "commit" in told
    buffers = [(b["name"], b["first"], b["channels"]) for b in json.loads(told["buffers"])]
    assert buffers == [
        ("position", 0, 3),
        ("normal", 3, 3),
        ("outgoing", 6, 3),
        ("albedo", 9, 3),
        ("roughness", 12, 1),
        ("emission", 13, 3),
    ]
    assert BUFFERS.keys() == BUFFER_CHANNELS.keys() | CHAIN_CHANNELS.keys() | DIRECT_CHANNELS.keys()


OURS, OLDER = (
    partial(kind, octaves=3, directions=True)
    for kind in (LinearEmissionGenerator, EncodedGenerator)
)


@pytest.mark.parametrize(
    ("make", "dimensions"),
    [(PixelGenerator, 2), (OURS, 2), (OURS, 0), (OLDER, 2)],
)
def test_a_network_that_adds_direct_light_gives_the_same_numbers(make, dimensions: int) -> None:
    layout = BufferLayout(("position", "normal", "outgoing", "direct", "emission"))
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network = make(
            layout=layout, scene_dimensions=dimensions, hidden_features=8, hidden_layers=2
        )
        buffers, v = 2 * torch.rand(20, layout.channels), torch.rand(dimensions)
    buffers[:5, layout.slice("emission")] = 0
    content = network_file(network, {})
    assert largest_difference(content, network, buffers, v) < 1e-5
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    [found] = session.run(None, {"buffers": buffers.numpy(), "v": v.numpy()})
    with torch.no_grad():
        exact = network.double()(buffers.double()[None, None], v.double()[None])[0, 0]
    np.testing.assert_allclose(found, exact.exp() - 1, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize("names", KNOWN_LIGHT)
def test_known_light_is_added_as_the_file_says(names: tuple[str, ...], linear: bool) -> None:
    layout = BufferLayout(("position", *names))
    output, buffers = torch.rand(50, 3), 2 * torch.rand(50, layout.channels)
    channels = {name: buffers[:, layout.slice(name)].numpy() for name in names}
    told, _, rest = known_light(layout, linear=linear).partition("; ")
    assert "nothing is to be added" in rest
    emitter, _, formula = told.rpartition("elsewhere ")
    known = {"expm1": np.expm1, "log1p": np.log1p, "o": output.numpy(), **channels}
    expected = eval(formula, known)
    if "emission" in names and not linear:
        assert emitter == "expm1(emission) in channels where emission > 1, "
        bright = channels["emission"] > 1
        expected = np.where(bright, np.expm1(channels["emission"]), expected)
    else:
        assert emitter == ""
    found = add_known_light(output, buffers, layout, linear_emission=linear).expm1()
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


def test_a_network_of_ours_says_what_of_v_it_is_given_and_how_it_is_shown(tmp_path: Path) -> None:
    folder = root() / "scenes" / "living-room" / "network"
    assert export.main([f"run={folder}", f"out={tmp_path / 'network.onnx'}"]) == 0
    session = onnxruntime.InferenceSession(tmp_path / "network.onnx")
    told = session.get_modelmeta().custom_metadata_map
    run = TrainedRun.open(folder)
    assert run.description is not None
    names, camera = run.description.component_names, run.description.camera_part
    assert json.loads(told["left_out"]) == [*names[camera]] != []
    given = [name for entry in json.loads(told["variables"]) for name in entry["components"]]
    assert given == [name for name in names if name not in names[camera]]
    assert told["buffer_samples"] == str(run.renderer.buffer_samples)
    v = run.renderer.hard_frames()[0]
    buffers = run.renderer.image_buffers(v, resolution=96)
    kept = torch.stack([u for name, u in zip(names, v, strict=True) if name in given])
    inputs = {"buffers": buffers.flatten(0, 1).numpy(), "v": kept.numpy()}
    [radiance] = session.run(None, inputs)
    shown = run.radiance(v, resolution=96).flatten(0, 1).numpy()
    difference = (np.abs(radiance - shown) / (1 + np.abs(radiance))).max()
    told_to_differ = told["precision"].partition("up to ")[2]
    assert bool(told_to_differ) == multiplies_bfloat16("cpu")
    stated = float(told_to_differ.split()[0]) if told_to_differ else 0
    assert difference == pytest.approx(stated, rel=0.06, abs=1e-5)  # it is told with two digits


def test_it_says_where_the_program_shows_something_else(exported: Path, trained: Path) -> None:
    """In the file itself, whose pixels know nothing of each other, there are no edges."""
    folder = trained / "finer"
    shutil.copytree(trained / "run", folder)
    settings = json.loads((folder / "settings.json").read_text())
    settings["data"]["supersampled_edges"] = True
    (folder / "settings.json").write_text(json.dumps(settings))
    assert export.main([f"run={folder}", f"out={trained / 'finer.onnx'}"]) == 0
    told = [
        onnxruntime.InferenceSession(file).get_modelmeta().custom_metadata_map
        for file in (trained / "finer.onnx", exported)
    ]
    where = told[0].pop("supersampled_edges")
    assert json.loads(where[where.index("{") :]) == LEAST
    assert told[0] == told[1]


def test_it_tells_no_path_of_this_machine(exported: Path) -> None:
    content = exported.read_bytes()
    for folder in (Path(torch.__file__).parents[1], Path(export.__file__).parents[1]):
        assert str(folder).encode() not in content
    assert b".py" not in content


def test_v_enters_once_per_image(exported: Path, opened: TrainedRun) -> None:
    graph = onnx.shape_inference.infer_shapes(onnx.load(exported)).graph
    shapes = {
        info.name: [dim.dim_value for dim in info.type.tensor_type.shape.dim]
        for info in graph.value_info
    }
    of_v, products = {"v"}, []
    for node in graph.node:
        if node.op_type in ("Gemm", "MatMul") and of_v & {*node.input}:
            products.append(shapes[node.output[0]])
        elif of_v & {*node.input}:
            of_v |= {*node.output}
    hidden = [[1, layer.out_features] for layer in opened.network.hidden]
    assert products[-len(hidden) - 1 :] == [*hidden, [1, 3]]  # the first layer does not see it


def ranged(entry: dict[str, Any], u: Iterator[float]) -> list[float]:
    """The value that the file's `v` says a variable has."""
    if "choices" in entry:
        n = len(entry["choices"])
        return [min(np.floor(n * next(u)), n - 1)]
    linked = next(u) if entry["linked"] and entry["minimum"] != entry["maximum"] else None
    return [
        low if low == high else low + (linked if linked is not None else next(u)) * (high - low)
        for low, high in zip(entry["minimum"], entry["maximum"], strict=True)
    ]


@pytest.mark.parametrize("scene", ["sphere-caustic", "living-room", "veach-door", "chess"])
def test_the_variables_can_be_set_by_what_it_says(scene: str) -> None:
    description = read_scene(**scenes()[scene])
    told = scene_metadata(description, range(description.dimensions))
    variables = json.loads(told["variables"])
    assert [name for entry in variables for name in entry["components"]] == [
        *description.component_names
    ]
    bounds = json.loads(told["bounds"])
    assert (bounds["minimum"], bounds["maximum"]) == tuple(map(list, description.bounds))
    v = np.random.default_rng(0).random(description.dimensions)
    u = iter(v)
    for entry, value in zip(variables, description.values(v), strict=True):
        np.testing.assert_allclose(ranged(entry, u), value)


def test_a_file_that_differs_is_not_written(
    trained: Path,
    exported: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(export, "TOLERANCE", 1e-12)
    monkeypatch.setattr("ngi.view.network_file.network_file", lambda *_: exported.read_bytes())
    out = trained / "refused.onnx"
    assert export.main([f"run={trained / 'run'}", f"out={out}"]) == 2
    assert "differs from the run's by" in capsys.readouterr().err
    assert not list(trained.glob("refused*"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("run=elsewhere",), "elsewhere/settings.json: no such file"),
        (("run=run", "out=network.pt2"), "'network.pt2' does not end with .onnx"),
        (("run=run", "out=nowhere/network.onnx"), "the folder nowhere does not exist"),
        (("out=network.onnx",), "give run="),
        (("run=run", "colour=red"), "'colour' is no option"),
    ],
)
def test_mistakes_are_named(
    trained: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.chdir(trained)
    try:
        status: Any = export.main(options)
    except SystemExit as ended:
        status = ended.code
    assert status == 2
    assert message in capsys.readouterr().err


def test_a_missing_extra_is_named(
    trained: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(trained)
    monkeypatch.setattr(export, "PACKAGES", ("onnx", "no_such_package"))
    assert export.main(["run=run"]) == 2
    assert f"no_such_package missing: {install_command('export')}" in capsys.readouterr().err
