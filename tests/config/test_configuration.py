"""Every option of every group builds what it names, so that no shipped configuration is broken."""

from pathlib import Path

import pytest
from hydra.utils import instantiate

from ngi.config.values import check_values
from ngi.explore import MarkovChains, PredictedLoss
from ngi.files.resources import scene_folders
from ngi.learn import PatchSamples, network_of
from ngi.models import PixelGenerator
from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer
from tests.config.command_line import CONF, composed

GROUPS = (
    *("sampler", "reuse", "resolution", "data", "model"),
    *("loss", "optimizer", "schedule", "averaging", "budget", "tracker"),
)
OPTIONS = [(g, f.stem) for g in GROUPS for f in sorted((CONF / g).glob("*.yaml"))]


@pytest.mark.parametrize(("group", "option"), OPTIONS)
def test_every_option_builds(group: str, option: str) -> None:
    node = composed(f"{group}={option}")[group]
    if group == "reuse":
        instantiate(node.policy)
        node = node.store
    built = instantiate(node)
    if group == "sampler":
        assert isinstance(built, MarkovChains | PredictedLoss)
        assert built.chains == 16
    if group == "model":
        samples = PatchSamples(renderer=AnalyticRenderer(dimensions=3, patch_size=16))
        built = network_of(samples, built)
    if group == "reuse":
        built = built(layout=BufferLayout())
    if group == "data":
        built = built(renderer=AnalyticRenderer(dimensions=3, patch_size=16))
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
    assert config.optimizer == {"_target_": "torch.optim.Adam", "_partial_": True, "lr": 1e-4}
    assert instantiate(config.schedule).factor(steps=0, used=0.99) == 1
    assert instantiate(config.averaging)(network) is None
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


@pytest.mark.parametrize(
    ("size", "rate"),
    [("budget=small", 1e-3), ("experiment=exploration_map", 2e-3), ("budget=smoke", 1e-4)],
)
def test_a_size_has_adams_rate_and_leaves_others_alone(size: str, rate: float) -> None:
    assert composed(size).optimizer.lr == rate
    assert composed(size).optimizer.keys() == {"_target_", "_partial_", "lr"}
    assert composed(size, "optimizer=muon").optimizer == composed("optimizer=muon").optimizer


@pytest.mark.parametrize(
    ("arguments", "folder"),
    [
        ("budget=small method=uniform", "outputs/small/sphere-caustic/method=uniform/seed=0"),
        (
            "budget=small budget.clock=model",
            "outputs/small-model-clock/sphere-caustic/default/seed=0",
        ),
        ("experiment=demo seed=2", "outputs/demo/sphere-caustic/default/seed=2"),
        ("scene=mirror budget=seconds", "outputs/seconds/mirror/default/seed=0"),
    ],
)
def test_a_folder_is_named_after_budget_scene_and_what_was_changed(
    arguments: str, folder: str
) -> None:
    config = composed(*arguments.split())
    assert config.run.folder == str(Path(folder).absolute())
    assert config.hydra.run.dir == config.hydra.sweep.subdir == config.run.folder


def test_hydra_writes_where_the_run_does() -> None:
    config = composed("run.folder=mine")
    assert config.hydra.run.dir == "mine"
    assert config.hydra.sweep.subdir == str(Path("mine").absolute())


def test_every_experiment_says_its_command() -> None:
    for file in (CONF / "experiment").glob("*.yaml"):
        assert "# python -m ngi." in file.read_text().splitlines()[1], file
        composed(f"experiment={file.stem}")


def test_every_key_that_an_experiment_adds_is_read() -> None:
    """As of sweeps (test_sweeps.py); there are no others that add any."""
    for file in (CONF / "experiment").glob("*.yaml"):
        check_values(composed(f"experiment={file.stem}"))


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


@pytest.mark.parametrize("given", [".", "scene.xml", "../bedroom"])
def test_so_they_are_however_the_folder_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    folder = tmp_path / "bedroom"
    folder.mkdir()
    (folder / "scene.xml").touch()
    monkeypatch.chdir(folder)
    assert composed("scene=release", f"scene.path={given}").scene.name == "release-bedroom"
