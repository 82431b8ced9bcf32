"""How often the host waits for the GPU in a training step, and where."""

from collections import Counter
from functools import partial
from itertools import islice
from pathlib import Path

import pytest
import torch

from ngi.explore import Loss, LossTimesOutputGradient, LossTimesStep, Target
from ngi.learn import IlluminationModule, StepGuard, patch_example, seeded, training_step
from ngi.models import L1Dssim, MuonAdam, PixelGenerator, exponential_average
from ngi.render import AnalyticRenderer
from tests.gpu.pretended import Ledger
from tests.learn.small_stream import make

OPTIMIZERS = {"adam": partial(torch.optim.Adam, lr=1e-3), "muon": MuonAdam}


def waits(
    folder: Path, ledger: Ledger, target: Target, optimizer_name: str
) -> dict[bool, list[Counter[str]]]:
    """By file, in each step after the first four; of generated batches and of stored ones."""
    stream = make(folder, target=target)
    module = IlluminationModule(
        network=seeded(PixelGenerator, seed=0)(
            layout=AnalyticRenderer(dimensions=3, patch_size=8).layout,
            scene_dimensions=3,
            hidden_features=12,
            hidden_layers=2,
        ),
        loss=L1Dssim(l1_weight=1.0, dssim_weight=1.0, window_size=5),
        optimizer=OPTIMIZERS[optimizer_name],
        example=patch_example,
        stream=stream,
        guard=StepGuard(stream=stream, folder=folder),
        averaging=partial(exponential_average, decay=0.9),
    ).to("cuda")
    optimizer = module.configure_optimizers()
    found: dict[bool, list[Counter[str]]] = {True: [], False: []}
    for number, batch in enumerate(islice(stream, 16)):
        ledger.clear()
        training_step(batch.to("cuda"), module.learner, optimizer=optimizer)
        if number >= 4:
            files = Counter[str]()
            for place, count in ledger.waits.items():
                files[place.partition(":")[0]] += count
            found[batch.generated].append(files)
    return found


@pytest.mark.parametrize("optimizer", OPTIMIZERS)
@pytest.mark.parametrize("target", [Loss(), LossTimesStep(), LossTimesOutputGradient()])
def test_a_step_waits_once(gpu: Ledger, tmp_path: Path, target: Target, optimizer: str) -> None:
    found = waits(tmp_path, gpu, target, optimizer)
    assert found[True]
    assert found[False]
    for files in (*found[True], *found[False]):
        assert files == {"learn/reading.py": 1}
