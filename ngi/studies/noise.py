"""How much of what chains find hard is noise: `python -m ngi.studies.noise --help`.

The loss of a patch is high where the network is wrong, and where the patch is noisy, from which
nothing can be learnt. Chains that follow the loss follow both.
"""

from __future__ import annotations

import json
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import hydra
from hydra.utils import instantiate
from omegaconf import DictConfig, open_dict
from tabulate import tabulate

from ngi.config.build import build_network, build_samples
from ngi.config.command_words import completed, with_overrides
from ngi.config.configuration import register
from ngi.config.hydra_program import job_of, run_program
from ngi.config.values import check_values
from ngi.files.resources import root
from ngi.files.run_folder import LAST
from ngi.studies.costs import in_this_process

if TYPE_CHECKING:
    from torch import Tensor

    from ngi.render import Renderer

MORE_SAMPLES = 32
"""Times the samples per pixel of training: what is left of its noise is a sixth."""

ROUNDS = 4
"""Of proposals, as many as there are chains each."""


def measure(config: DictConfig) -> list[tuple[str, float, float, float]]:
    """Per set of states: its name, mean loss at the samples of training and at more, noise's part.

    The network, the chains and the resolution are those of the run's newest checkpoint. Raises
    ValueError where there is none, and for one of another scene.
    """
    import torch

    from ngi import learn
    from ngi.explore import Proposals
    from ngi.learn.ahead import ProposalsAhead
    from ngi.view.trained_run import NETWORK

    check_values(config)
    folder = Path(config.run.folder)
    path = folder / LAST
    if not path.exists():
        raise ValueError(f"{path} does not exist; give the command line that started the run")
    checkpoint = learn.read_checkpoint(path)
    weights = {
        name.removeprefix(NETWORK): value
        for name, value in checkpoint["state_dict"].items()
        if name.startswith(NETWORK)
    }
    states, resolution = _states(config, checkpoint[learn.STREAM])
    losses: dict[str, list[Tensor]] = {name: [] for name in states}
    for factor in (1, MORE_SAMPLES):
        with closing(_renderer(config, folder, factor=factor)) as renderer:
            samples = build_samples(config, renderer=renderer)
            network, loss = build_network(config, samples=samples), instantiate(config.loss)
            network.load_state_dict(weights)
            for name, of_set in states.items():
                for chunk in of_set.split(config.sampler.chains):
                    proposals = Proposals(chunk, torch.ones(len(chunk), dtype=torch.bool))
                    ahead = ProposalsAhead(proposals, resolution=resolution, seed=factor)
                    ahead.start(samples)
                    inputs, truth = samples.example(ahead.patches().to("cpu"))
                    with torch.no_grad():
                        losses[name].append(loss(network(*inputs), truth))
    rows = []
    for name, parts in losses.items():
        noisy, clean = torch.cat(parts).reshape(2, -1).mean(dim=1).tolist()
        rows.append((name, noisy, clean, 1 - clean / noisy))
    return rows


def _states(config: DictConfig, stream: dict[str, object]) -> tuple[dict[str, Tensor], int]:
    """The sets of states, [n, D + 2] each, and the resolution of the next proposals."""
    import torch

    from ngi.clock.counters import Counters

    sampler, generator = instantiate(config.sampler), torch.Generator().manual_seed(config.seed)
    if sampler.needs_description:
        raise ValueError(
            "sampler: it inspects patches before they are traced, which this study does not "
            "support; name a run with another sampler, for example one of method=ours"
        )
    chains = type(sampler.init(2)).from_state_dict(stream["chains"])
    counters = Counters(**stream["counters"])  # type: ignore[arg-type]
    first = counters.proposed_batches
    proposals = [
        sampler.propose(chains, generator, batch=batch).position
        for batch in range(first, first + ROUNDS)
    ]
    count, dimensions = torch.cat(proposals).shape
    states = {
        "where the chains stand": chains.position,
        "what they propose": torch.cat(proposals),
        "uniform": torch.rand(count, dimensions, generator=generator),
    }
    return states, instantiate(config.resolution).resolution(counters.iteration)


def _renderer(config: DictConfig, folder: Path, *, factor: int) -> Renderer:
    chosen = in_this_process(config.renderer)
    renderer: Renderer = instantiate(chosen)
    scene = json.loads((folder / "settings.json").read_text())["scene"]
    if scene["hash"] != renderer.scene_hash:
        raise ValueError(f"{folder} is a run of an earlier version of the scene '{scene['name']}'")
    samples = factor * renderer.samples_per_pixel
    renderer.close()
    with open_dict(chosen):
        chosen.samples_per_pixel = samples
    noisier: Renderer = instantiate(chosen)
    return noisier


@hydra.main(version_base="1.3", config_path=str(root() / "conf"), config_name="train")
def _main(config: DictConfig) -> None:
    with job_of(config.run.folder):
        rows = measure(config)
    heading = ("states", "loss", f"at {MORE_SAMPLES} times the samples", "part that is noise")
    print(tabulate(rows, heading, floatfmt=("", ".4f", ".4f", ".0%"), tablefmt="github"))


def main() -> None:
    """Entry point of `python -m ngi.studies.noise`."""
    register()
    sys.argv[1:] = with_overrides(completed(sys.argv[1:]), "hydra/help=noise")
    run_program(_main)


if __name__ == "__main__":
    main()
