"""Every option of every group builds what it names, so that no shipped configuration is broken."""

from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig

from ngi.explore import MarkovChains
from ngi.models import PixelGenerator
from ngi.patches import BufferLayout
from ngi.resources import root, scene_folders
from ngi.train import register

CONF = root() / "conf"
GROUPS = ("sampler", "reuse", "resolution", "model", "loss", "optimizer", "budget", "tracker")
OPTIONS = [(g, f.stem) for g in GROUPS for f in sorted((CONF / g).glob("*.yaml"))]


def composed(*overrides: str) -> DictConfig:
    register()
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(CONF), version_base="1.3"):
        config = compose("train", list(overrides), return_hydra_config=True)
    HydraConfig.instance().set_config(config)
    return config


@pytest.mark.parametrize(("group", "option"), OPTIONS)
def test_every_option_builds(group: str, option: str) -> None:
    node = composed(f"{group}={option}")[group]
    if group == "reuse":
        instantiate(node.policy)
        node = node.store
    built = instantiate(node)
    if group == "sampler":
        assert isinstance(built, MarkovChains)
        assert built.chains == 16
    if group in ("model", "reuse"):
        arguments = {"scene_dimensions": 3} if group == "model" else {}
        built = built(layout=BufferLayout(), **arguments)
    assert built is not None


@pytest.mark.parametrize("option", [f.stem for f in sorted((CONF / "evaluation").glob("*.yaml"))])
def test_every_protocol_has_its_own_name(option: str) -> None:
    protocol = instantiate(composed(f"evaluation={option}").evaluation.evaluator.protocol)
    assert protocol.name == option


def test_the_defaults_are_the_papers() -> None:
    config = composed()
    network = instantiate(config.model)(layout=BufferLayout(), scene_dimensions=12)
    assert isinstance(network, PixelGenerator)
    assert len(network.hidden) + 1 == 8
    assert config.model.hidden_features == 512
    assert config.optimizer.lr == 1e-4
    assert config.reuse.policy.beta == 4.6
    assert config.reuse.policy.bootstrap_batches == 100
    assert config.sampler.proposal.large_step_probability == 0.3
    schedule = instantiate(config.resolution)
    assert [schedule.resolution(i) for i in (0, 1999, 2000, 236_000, 10**6)] == [
        128,
        128,
        132,
        600,
        600,
    ]


def test_methods_pair_sampler_and_resolution_as_the_paper_does() -> None:
    choices = composed("method=uniform").hydra.runtime.choices
    assert (choices.sampler, choices.resolution) == ("uniform", "constant")
    choices = composed("method=active_exploration").hydra.runtime.choices
    assert (choices.sampler, choices.resolution) == ("mcmc_loss_step", "growing")


@pytest.mark.parametrize("sweep", [f.stem for f in sorted((root() / "sweeps").glob("*.yaml"))])
def test_every_sweep_says_its_command_and_composes(sweep: str) -> None:
    text = (root() / "sweeps" / f"{sweep}.yaml").read_text()
    assert f"python -m ngi.train -m +sweeps={sweep}" in text.splitlines()[1]
    config = composed(f"+sweeps={sweep}")
    assert config.hydra.sweeper.params


def test_every_experiment_says_its_command() -> None:
    for file in (CONF / "experiment").glob("*.yaml"):
        assert "python -m ngi.train" in file.read_text().splitlines()[1], file
        composed(f"experiment={file.stem}")


def test_a_scene_is_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "scene.yaml").write_text("name: mine\n")
    monkeypatch.setenv("NGI_SCENES", str(tmp_path))
    assert scene_folders()["mine"] == tmp_path / "mine"
    assert composed("scene=mine").scene.reader.folder == str(tmp_path / "mine")


def test_the_authors_scenes_are_named_after_their_folder() -> None:
    config = composed("scene=release", "scene.path=/some/where/bedroom")
    assert config.scene.name == "release-bedroom"
    assert config.renderer.scene.path == "/some/where/bedroom"
    assert config.renderer.scene["_target_"] == "ngi.scene.release.read_release"
