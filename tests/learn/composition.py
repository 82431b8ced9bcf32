"""The configuration of a run in this process, as the entry points get it."""

from omegaconf import DictConfig, open_dict

from tests.config.command_line import composed


def run_config(*overrides: str) -> DictConfig:
    """Of a run on closed formulas, writing into ./run unless `run.folder` says where."""
    config = composed("renderer=analytic", "run.folder=run", *overrides)
    with open_dict(config):
        del config["hydra"]
    return config
