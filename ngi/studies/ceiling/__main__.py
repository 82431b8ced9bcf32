"""Entry point: `python -m ngi.studies.ceiling --help`."""

from __future__ import annotations

import logging
import sys

import hydra
from omegaconf import DictConfig

from ngi.config.command_words import with_overrides
from ngi.config.configuration import register
from ngi.config.hydra_program import job_of, run_program
from ngi.config.values import check_values
from ngi.files.resources import root
from ngi.machine.repeatable import make_repeatable

log = logging.getLogger(__name__)


@hydra.main(version_base="1.3", config_path=str(root() / "conf"), config_name="train")
def _main(config: DictConfig) -> None:
    from ngi.studies.ceiling.campaign import run_all  # PyTorch takes seconds

    with job_of(config.run.folder):
        check_values(config)
        make_repeatable()
        log.info("written: %s", run_all(config))


def main() -> None:
    """Entry point of `python -m ngi.studies.ceiling`."""
    register()
    sys.argv[1:] = with_overrides(sys.argv[1:], "experiment=ceiling", "hydra/help=ceiling")
    run_program(_main)


if __name__ == "__main__":
    main()
