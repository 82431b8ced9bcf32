"""A report's tables at Weights & Biases, in a run of their own."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import pandas as pd


def send(files: Sequence[Path], *, name: str, project: str) -> Path:
    """Logs results.csv as a table and the page and tables as an artifact 'report-NAME'.

    files: of a report, all in one folder; pictures are left out, the page holds them
    name: of what is reported

    Offline, unless the variable WANDB_MODE says online; returns the folder that W&B writes into.
    Raises RuntimeError where wandb is not installed.
    """
    try:
        import wandb  # only who asks for it pays for its import
    except ImportError as error:
        raise RuntimeError(
            f"--wandb: wandb cannot be imported ({error}); pip install wandb"
        ) from error
    kept = [file for file in files if file.suffix in (".html", ".csv", ".md", ".tex")]
    (results,) = (file for file in kept if file.name == "results.csv")
    with wandb.init(
        project=project,
        mode=None if "WANDB_MODE" in os.environ else "offline",
        dir=results.parent,
        job_type="report",
        name=f"report of {name}",
        settings=wandb.Settings(quiet=True),
    ) as run:
        run.log({"results": wandb.Table(dataframe=pd.read_csv(results))})
        allowed = re.sub(r"[^\w.-]+", "-", name, flags=re.ASCII)
        artifact = wandb.Artifact(f"report-{allowed}", type="report")
        for file in kept:
            artifact.add_file(str(file))
        run.log_artifact(artifact)
        return Path(run.dir)
