"""The paper's methods give the numbers that they gave before there was a method of our own."""

import csv

import pytest

from .command_line import run

OVERRIDES = (
    "renderer=analytic",
    "renderer.patch_size=16",
    "resolution.start=32",
    "model.hidden_features=24",
    "budget=smoke",
    "budget.steps=40",
    "evaluation.count=1",
    "seed=7",
)
LOSSES = {  # of steps 1, 20 and 40, and their sum over all 40, at commit 68bb89c
    "active_exploration": (0.7476980090, 0.7994552851, 0.8483254910, 32.1653033493),
    "uniform": (0.7476980090, 0.7066750526, 0.5604605675, 26.7937300801),
    "metropolis": (0.7476980090, 0.6781468391, 0.6622552276, 27.7961507439),
    "loss_target": (0.7476980090, 0.8727049828, 0.8149619698, 31.9407098889),
}
TOLERANCE = 1e-5
"""Another processor may round a product otherwise; on the same one all digits agree."""


@pytest.mark.parametrize("method", LOSSES)
def test_the_losses_of_a_run_are_those_of_68bb89c(tmp_path, method: str) -> None:
    status, output = run(tmp_path, f"method={method}", "run.folder=run", base=OVERRIDES)
    assert status == 0, output
    with (tmp_path / "run" / "steps.csv").open() as file:
        losses = [float(row["loss"]) for row in csv.DictReader(file)]
    found = (losses[0], losses[19], losses[39], sum(losses))
    assert found == pytest.approx(LOSSES[method], rel=TOLERANCE)
