from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import torch
from torch import Tensor

from ngi.explore import Loss, Signals, Target
from ngi.learn import STREAM, PatchSamples, TargetMap
from ngi.learn.target_map import PATCHES_AT_ONCE, map_states
from ngi.models import L1Dssim, PixelGenerator
from ngi.patches import Patches
from ngi.render import AnalyticRenderer
from tests.files.test_record_log import read
from tests.learn.command_line import start
from tests.learn.comparison import assert_same
from tests.warm import finish

CELLS, POSITIONS = 3, 2


def target_map(
    cells: int = CELLS,
    positions: int = POSITIONS,
    dimensions: int = 2,
    noise: float = 0.0,
    **options: Any,
) -> TargetMap:
    renderer = AnalyticRenderer(dimensions=dimensions, patch_size=16, noise=noise)
    return TargetMap(
        cells=cells,
        positions_per_cell=positions,
        target=Loss(),
        resolution=32,
        samples=PatchSamples(renderer=renderer),
        **options,
    )


def place(patches: Patches, _: Target) -> Signals:
    """A loss that says where a patch is: v[0] + 10 v[1]."""
    return Signals(patches.scene_vector @ torch.tensor([1.0, 10.0]))


def test_states_lie_in_their_cells_and_fill_them_evenly() -> None:
    states = map_states(5, 64)
    assert states.shape == (5, 5, 64, 4)
    inside = 5 * states[..., :2]
    for axis in range(2):
        cell = torch.arange(5.0).reshape((5, 1, 1) if axis == 0 else (1, 5, 1))
        inside[..., axis] -= cell
    # In all dimensions at once: no sixteenth of a cell's 4-dimensional box is left out.
    points = torch.cat([inside, states[..., 2:]], dim=-1).flatten(0, 1)
    assert points.min() >= 0
    assert points.max() <= 1
    corners = ((points * 2).long().clamp(max=1) * torch.tensor([8, 4, 2, 1])).sum(-1)
    counts = torch.stack([torch.bincount(corner, minlength=16) for corner in corners])
    assert counts.min() == counts.max() == 4
    assert len(points.flatten(0, 1).unique(dim=0)) == 5 * 5 * 64
    assert torch.equal(states, map_states(5, 64))


def test_the_first_index_is_the_first_variable() -> None:
    measured = target_map(cells=4, positions=3, signals=place).measure()
    assert measured["target"].shape == (4, 4, 3)
    centre = (np.arange(4) + 0.5) / 4
    expected = centre[:, None, None] + 10 * centre[None, :, None]
    np.testing.assert_allclose(
        measured["target"], np.broadcast_to(expected, (4, 4, 3)), atol=11 / 8
    )
    np.testing.assert_array_equal(measured["loss"], measured["target"])


def test_patches_are_rendered_once_and_no_global_state_is_touched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = torch.random.get_rng_state()
    made = target_map(cells=6, signals=place)
    made.prepare()
    monkeypatch.setattr(AnalyticRenderer, "render_patches", None)
    first = made.measure()
    np.testing.assert_array_equal(made.measure()["loss"], first["loss"])
    assert torch.equal(torch.random.get_rng_state(), before)


def test_all_runs_have_the_same_noise_and_each_chunk_its_own() -> None:
    """The seed of a chunk's rendering is its number."""
    rendered: list[Tensor] = []

    def keep(patches: Patches, _: Target) -> Signals:
        rendered.append(patches.log_radiance)
        return Signals(torch.zeros(len(patches.scene_vector)))

    target_map(cells=4, positions=3, noise=0.1, signals=keep).measure()
    renderer = AnalyticRenderer(dimensions=2, patch_size=16, noise=0.1)
    chunks = map_states(4, 3).flatten(0, 2).split(PATCHES_AT_ONCE)
    assert len(rendered) == len(chunks) == 3
    for seed, (found, states) in enumerate(zip(rendered, chunks, strict=True)):
        expected = renderer.render_patches(states, resolution=32, seed=seed).log_radiance
        torch.testing.assert_close(found, expected, rtol=2**-11, atol=2**-25)  # half precision


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"dimensions": 3}, r"evaluation\.target_map: the scene has 3 variables.*scene=mirror"),
        ({"cells": 0}, r"evaluation\.target_map\.cells: 0"),
        ({"positions": 0}, r"evaluation\.target_map\.positions_per_cell: 0"),
    ],
)
def test_what_makes_no_map_is_refused(options: dict[str, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        target_map(**options, signals=place)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same run with and without a map."""
    folder = tmp_path_factory.mktemp("runs")
    node = (
        f"{{_target_:ngi.learn.TargetMap,_partial_:true,cells:{CELLS},"
        f"positions_per_cell:{POSITIONS},target:{{_target_:ngi.explore.LossTimesStep}}}}"
    )
    processes = {
        name: start(
            folder,
            "renderer.dimensions=2",
            f"run.folder={name}",
            f"evaluation.target_map={value}",
            output=folder / f"{name}.log",
        )
        for name, value in (("without", "null"), ("with", node))
    }
    for name, process in processes.items():
        status, output = finish(process, folder / f"{name}.log", seconds=300)
        assert status == 0, output
    return {name: folder / name for name in processes}


def test_a_run_does_not_notice_its_map(runs: dict[str, Path]) -> None:
    states = []
    for folder in runs.values():
        checkpoint = torch.load(folder / "last.ckpt", weights_only=True)
        parts = ("state_dict", "optimizer_states", STREAM, "global_step")
        states.append({part: checkpoint[part] for part in parts})
    assert_same(*states)
    chains = [read(folder / "chains.bin") for folder in runs.values()]
    assert chains[0].tobytes() == chains[1].tobytes()
    assert not (runs["without"] / "target_map.bin").exists()


def test_a_record_per_evaluation(runs: dict[str, Path]) -> None:
    records = read(runs["with"] / "target_map.bin")
    metrics = pd.read_csv(runs["with"] / "metrics.csv")
    assert records["step"].tolist() == metrics["step"].tolist()
    np.testing.assert_allclose(records["run_seconds"], metrics["run_seconds"])
    assert not np.array_equal(records["target"][0], records["target"][1])


def test_the_map_is_loss_times_the_step_that_adam_takes(runs: dict[str, Path]) -> None:
    """Each patch alone is trained on for one step, from the run's checkpoint."""
    checkpoint = torch.load(runs["with"] / "last.ckpt", weights_only=True)
    renderer = AnalyticRenderer(dimensions=2, patch_size=16)
    states = map_states(CELLS, POSITIONS).flatten(0, 2)
    rendered = (
        target_map(signals=place)._render(states, seed=0).expand()
    )  # as stored, in half precision
    last = read(runs["with"] / "target_map.bin")[-1]
    for index, state in enumerate(states):
        loss, norm = adam_step(
            checkpoint,
            renderer,
            rendered.buffers[index : index + 1].double(),
            state[None, :2].double(),
            rendered.log_radiance[index : index + 1].double(),
        )
        np.testing.assert_allclose(last["loss"].flat[index], loss, rtol=1e-5)
        np.testing.assert_allclose(last["target"].flat[index], loss * norm, rtol=1e-4)


def adam_step(
    checkpoint: dict[str, Any],
    renderer: AnalyticRenderer,
    buffers: Tensor,
    scene_vector: Tensor,
    log_radiance: Tensor,
) -> tuple[float, float]:
    """Loss of one sample, and by how much a step on it moves the weights."""
    network = PixelGenerator(
        layout=renderer.layout, scene_dimensions=2, hidden_features=16, hidden_layers=2
    ).double()
    weights = checkpoint["state_dict"]
    network.load_state_dict({k.removeprefix("network."): v.double() for k, v in weights.items()})
    optimizer = torch.optim.Adam(network.parameters())
    optimizer.load_state_dict(deepcopy(checkpoint["optimizer_states"][0]))  # it would share it
    before = torch.nn.utils.parameters_to_vector(network.parameters()).detach().clone()
    optimizer.zero_grad()
    loss = L1Dssim(l1_weight=1.0, dssim_weight=1.0)(network(buffers, scene_vector), log_radiance)
    loss.sum().backward()
    optimizer.step()
    after = torch.nn.utils.parameters_to_vector(network.parameters()).detach()
    return loss.item(), float((after - before).norm())
