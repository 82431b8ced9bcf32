"""What the program stores when it trains on a scene that is rendered."""

from pathlib import Path

import pandas as pd
import torch

from ngi.learn import STREAM
from tests.learn.command_line import SMALL, run


def stored_buffers(folder: Path, *options: str) -> list[str]:
    """Names of the buffers of its patches, after a training run of 12 steps with these options."""
    rendered = (
        *(option for option in SMALL if option != "renderer=analytic"),
        "renderer.samples_per_pixel=2",
        "evaluation.evaluator.protocol.resolution=32",
        "run.folder=run",
    )
    status, output = run(folder, *options, base=rendered)
    assert status == 0, output
    assert len(pd.read_csv(folder / "run" / "steps.csv")) == 12
    state = torch.load(folder / "run" / "last.ckpt", weights_only=True)
    buffers: list[str] = state[STREAM]["store"]["buffers"]
    return buffers
