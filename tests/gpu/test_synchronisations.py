"""How often the host waits for the GPU in a training step, and where."""

from collections import Counter
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

import pytest
import torch

from ngi.explore import Loss, LossTimesOutputGradient, LossTimesStep, Target
from ngi.learn import IlluminationModule, StepGuard, patch_example, seeded, training_step
from ngi.learn.captured_pass import CapturedPass
from ngi.learn.state_before import StateBefore
from ngi.models import L1Dssim, MuonAdam, PixelGenerator, exponential_average
from ngi.render import AnalyticRenderer
from ngi.reuse import DrawingRule, Epochs, FixedProbability
from tests.gpu.pretended import Ledger
from tests.learn.small_stream import make

OPTIMIZERS = {"adam": partial(torch.optim.Adam, lr=1e-3), "muon": MuonAdam}


def waits(
    folder: Path,
    ledger: Ledger,
    target: Target,
    optimizer_name: str,
    *,
    recorded: bool,
    late: bool = False,
    rule: DrawingRule | None = None,
) -> dict[bool, list[Counter[str]]]:
    """By file, in each step after the first four; of generated batches and of stored ones.

    The batch that a step is taken on is made in it too. 'late' counts looks at the step before.
    """
    policy = FixedProbability(bootstrap_batches=3, probability=0.75)  # stored ones in a row, too
    stream = make(folder, target=target, device="cuda", rule=rule, policy=policy)
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
    learner = module.learner
    if recorded:
        captured = CapturedPass(module.network, module.loss, precision=nullcontext)
        learner = replace(learner, captured=captured)
    optimizer = module.configure_optimizers()
    if late:
        before = StateBefore(network=module.network, averaged=module.averaged, optimizer=optimizer)
        learner = replace(learner, before=before)
    found: dict[bool, list[Counter[str]]] = {True: [], False: []}
    for number, batch in enumerate(islice(stream, 16)):
        training_step(batch.to("cuda"), learner, optimizer=optimizer)
        if number >= 4:
            files = Counter[str]()
            for place, count in ledger.waits.items():
                files[place.partition(":")[0]] += count
            assert set(ledger.looks) <= {1}  # the passes of this step were queued before
            files["late"] = len(ledger.looks)
            found[batch.generated].append(+files)
            assert batch.generated or not ledger.uploads
        ledger.clear()
    return found


TARGETS = (Loss(), LossTimesStep(), LossTimesOutputGradient())
CASES = [
    *((target, optimizer, False) for target in TARGETS for optimizer in OPTIMIZERS),
    (Loss(), "adam", True),
    (LossTimesStep(), "muon", True),
]


@pytest.mark.parametrize(("target", "optimizer", "recorded"), CASES)
def test_a_step_waits_once(
    gpu: Ledger, tmp_path: Path, target: Target, optimizer: str, recorded: bool
) -> None:
    found = waits(tmp_path, gpu, target, optimizer, recorded=recorded)
    assert found[True]
    assert found[False]
    for files in found[False]:
        assert files == {"learn/reading.py": 1}
    for files in found[True]:  # whether patches are finite, traced and in half precision
        assert files == {"learn/reading.py": 2, "reuse/compact.py": 1}


@pytest.mark.parametrize("optimizer", OPTIMIZERS)
@pytest.mark.parametrize("recorded", [True, False])
def test_a_step_on_stored_patches_does_not_wait_where_nothing_is_drawn_by_its_losses(
    gpu: Ledger, tmp_path: Path, optimizer: str, recorded: bool
) -> None:
    found = waits(tmp_path, gpu, Loss(), optimizer, recorded=recorded, late=True, rule=Epochs())
    assert {*map(str, found[False])} == {"Counter()", "Counter({'late': 1})"}
    for files in found[True]:  # as any other
        assert files == {"learn/reading.py": 2, "reuse/compact.py": 1}


def test_where_patches_are_drawn_by_losses_it_waits_once(gpu: Ledger, tmp_path: Path) -> None:
    found = waits(tmp_path, gpu, LossTimesStep(), "adam", recorded=True, late=True)
    assert found[False]
    assert all(files == {"learn/reading.py": 1} for files in found[False])
