"""Every option of every group builds what it names, so that no shipped configuration is broken."""

from functools import cache
from pathlib import Path

import pytest
import yaml
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, open_dict

from analysis.claims import WITH_OURS
from ngi.config.configuration import register
from ngi.explore import MarkovChains, PredictedLoss
from ngi.files.resources import root, scene_folders
from ngi.models import PixelGenerator
from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer

CONF = root() / "conf"
GROUPS = (
    *("sampler", "reuse", "resolution", "data", "model"),
    *("loss", "optimizer", "schedule", "averaging", "budget", "tracker"),
)
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
        assert isinstance(built, MarkovChains | PredictedLoss)
        assert built.chains == 16
    if group in ("model", "reuse"):
        arguments = {"scene_dimensions": 3} if group == "model" else {}
        built = built(layout=BufferLayout(), **arguments)
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


PRECONDITIONED, PLAIN = "pixel_generator", "pixel_generator_no_preconditioning"
COMPETITORS = ("cnsr", "anf")
"""Other methods, whose samples are of another size."""
EXPLORING = {
    "ours_exploring": "mcmc_loss_step",
    "ours_loss_target": "mcmc_loss",
    "ours_metropolis": "mcmc_metropolis",
}
OURS = ("ours", "ours_uniform", *EXPLORING)
LIGHT = ["specular", "direct and caustics"]
METHODS = {  # sampler, resolution, model, what the renderer traces into the buffers
    "active_exploration": ("mcmc_loss_step", "growing", PRECONDITIONED, []),
    "uniform": ("uniform", "constant", PRECONDITIONED, []),
    "uniform_growing": ("uniform", "growing", PRECONDITIONED, []),
    "sobol": ("sobol", "constant", PRECONDITIONED, []),
    "latin_hypercube": ("latin_hypercube", "constant", PRECONDITIONED, []),
    "fixed_data": ("uniform", "constant", PRECONDITIONED, []),
    "prioritised_replay": ("uniform", "constant", PRECONDITIONED, []),
    "constant_resolution": ("mcmc_loss_step", "constant", PRECONDITIONED, []),
    "loss_target": ("mcmc_loss", "growing", PRECONDITIONED, []),
    "output_gradient_target": ("mcmc_output_gradient", "growing", PRECONDITIONED, []),
    "metropolis": ("mcmc_metropolis", "growing", PRECONDITIONED, []),
    "no_preconditioning": ("mcmc_loss_step", "growing", PLAIN, []),
    "cnsr": ("uniform", "constant", "cnsr", []),
    "anf": ("uniform", "constant", "anf", []),
    "traced_specular": ("mcmc_loss_step", "growing", PRECONDITIONED, ["specular"]),
    "ours": ("sobol", "constant", "encoded_generator", LIGHT),
    "ours_uniform": ("uniform", "constant", "encoded_generator", LIGHT),
    **{
        method: (sampler, "constant", "encoded_generator", LIGHT)
        for method, sampler in EXPLORING.items()
    },
    "traced_direct": ("mcmc_loss_step", "growing", PRECONDITIONED, ["direct"]),
}
PRIORITISED = {"_target_": "ngi.reuse.Prioritised", "alpha": 0.6, "beta": 0.4, "epsilon": 1e-6}


PATH_TRACING = {  # option, samples per pixel
    f"path_tracing{name}{suffix}": (option, samples)
    for name, option in (("", "plain"), ("_oidn", "oidn"), ("_optix", "optix"))
    for suffix, samples in (("", None), ("_8spp", 8))
}


def test_every_method_is_listed_here() -> None:
    found = {file.stem for file in (CONF / "method").glob("*.yaml")}
    assert found == METHODS.keys() | PATH_TRACING.keys()


@pytest.mark.parametrize("method", PATH_TRACING)
def test_path_tracing_takes_the_place_of_training_and_changes_nothing_else(method: str) -> None:
    config = composed(f"method={method}", "budget=small")
    chosen, other = config.hydra.runtime.choices, composed("budget=small")
    assert (chosen.path_tracing, config.path_tracing.samples_per_pixel) == PATH_TRACING[method]
    assert config.path_tracing.milliseconds is None
    assert {key: config[key] for key in other if key not in ("hydra", "label")} == {
        key: other[key] for key in other if key not in ("hydra", "label")
    }
    assert "path_tracing" not in other


@pytest.mark.parametrize("method", METHODS)
def test_a_method_differs_where_its_name_says_and_nowhere_else(method: str) -> None:
    config = composed(f"method={method}", "budget=small")
    chosen = config.hydra.runtime.choices
    words = {"learned": "", "traced": "{}", "with_caustics": "{} and caustics"}
    traced = [words[config.renderer[name]].format(name) for name in ("specular", "direct")]
    traced = [name for name in traced if name]
    found = (chosen.sampler, chosen.resolution, chosen.model, traced)
    assert found == METHODS[method]
    assert config.label.method == method
    other = composed("budget=small")
    if method == "fixed_data":
        other.reuse = composed("budget=small", "reuse=epochs").reuse
    if method == "prioritised_replay":
        with open_dict(other):
            other.reuse.store.rule = PRIORITISED
    parts = ("scene", "budget", "evaluation", "trainer")
    own = () if method in COMPETITORS else ("data", "reuse", "loss")
    own = () if method in OURS else ("optimizer", "schedule", "averaging", *own)
    for part in (*parts, *own):
        assert config[part] == other[part], part


@pytest.mark.parametrize("method", OURS)
def test_ours_differs_in_every_part_that_can_be_taken_out_again(method: str) -> None:
    chosen = composed(f"method={method}", "budget=small").hydra.runtime.choices
    parts = ("optimizer", "schedule", "averaging", "data", "reuse")
    options = {part: chosen[part] for part in parts}
    assert options == {
        "optimizer": "muon",
        "schedule": "warmup_stable_decay",
        "averaging": "exponential",
        "data": "denoised_patches",
        "reuse": "steady",
    }


def test_ours_trains_on_images_as_large_as_those_that_are_shown() -> None:
    for budget, shown in (("small", 96), ("paper", 256)):
        config = composed("method=ours", f"budget={budget}")
        schedule = instantiate(config.resolution)
        assert [schedule.resolution(step) for step in (0, 10**6)] == [shown, shown]


def test_the_store_of_a_competitor_holds_as_many_pixels() -> None:
    config, other = composed("method=cnsr"), composed("method=uniform")
    images = 1 + config.data.observations
    pixels = images * config.renderer.patch_size**2 * config.reuse.store.capacity
    assert pixels == other.renderer.patch_size**2 * other.reuse.store.capacity
    assert {**config.reuse.policy, "bootstrap_batches": 100} == other.reuse.policy
    assert config.resolution.start == config.renderer.patch_size == 64


@pytest.mark.parametrize("budget", ["smoke", "small", "paper"])
def test_the_denoiser_gets_8_samples_and_896_patches_whatever_the_budget(budget: str) -> None:
    config = composed("method=anf", f"budget={budget}")
    assert config.renderer.samples_per_pixel == 8
    pixels = config.data.frames * config.renderer.patch_size**2 * config.reuse.store.capacity
    assert pixels == 896 * composed().renderer.patch_size ** 2


BUDGETS = ("smoke", "small", "paper")
SWEEPS = [file.stem for file in sorted((root() / "sweeps").glob("*.yaml"))]
OF_ONE_SIZE = ("demo", "learner", "minute", "needed", "smoke", "stability")
"""Sweeps that are no table or figure of the paper."""


@pytest.mark.parametrize("sweep", SWEEPS)
def test_every_sweep_says_its_command(sweep: str) -> None:
    text = (root() / "sweeps" / f"{sweep}.yaml").read_text()
    assert f"python -m ngi.train -m +sweeps={sweep}" in text.splitlines()[1]
    assert composed(f"+sweeps={sweep}").hydra.sweeper.params


OF_THE_PAPER = [sweep for sweep in SWEEPS if sweep not in OF_ONE_SIZE]


@pytest.mark.parametrize("sweep", SWEEPS)
def test_every_scene_of_a_sweep_is_there(sweep: str) -> None:
    scenes = composed(f"+sweeps={sweep}").hydra.sweeper.params.get("scene", "")
    for scene in scenes.split(",") if scenes else ():
        assert name_of(scene, *own_words(sweep)) == scene


@cache
def name_of(scene: str, *more: str) -> str:
    name: str = composed(*more, f"scene={scene}").scene.name
    return name


def own_words(sweep: str) -> list[str]:
    """Those that a run of it has, which says more than what is swept over; none for others."""
    text = (root() / "sweeps" / f"{sweep}.yaml").read_text()
    return [] if yaml.safe_load(text).keys() == {"hydra"} else [f"+sweeps={sweep}"]


@pytest.mark.parametrize("budget", BUDGETS)
@pytest.mark.parametrize("sweep", OF_THE_PAPER)
def test_every_sweep_of_the_paper_is_there_at_every_budget(sweep: str, budget: str) -> None:
    params = composed(f"+sweeps={sweep}", f"budget={budget}").hydra.sweeper.params
    assert next(iter(params)) == "seed", "seeds have to vary slowest"
    seeds, methods = (params[key].split(",") for key in ("seed", "method"))
    assert len(seeds) >= 3
    assert len(methods) >= 2
    more = [f"reuse={params.reuse}"] if "reuse" in params else []
    for method in methods:
        check_method(method, budget, *more, *own_words(sweep))


@cache
def check_method(method: str, budget: str, *more: str) -> None:
    """Once, however many sweeps name it that say nothing but what is swept over."""
    config = composed(f"budget={budget}", f"method={method}", *more)
    assert config.label.budget == budget
    assert config.label.method == method
    for part in (config.sampler, config.reuse.policy, config.resolution, config.budget):
        instantiate(part)
    assert instantiate(config.model)(layout=BufferLayout(), scene_dimensions=3) is not None


CHANGED = {
    "muon": "optimizer",
    "decay": "schedule",
    "averaging": "averaging",
    "encodings": "model",
    "relative_positions": "model",
    "relative_loss": "loss",
    "camera_left_out": "data",
    "denoised_targets": "data",
    "direct_light": "renderer",
    "caustics": "renderer",
    "specular_bounces": "renderer",
    "steady_reuse": "reuse",
    "large_images": "resolution",
    "small_batches": "sampler",
}
"""The group that each part of ours belongs to."""


@pytest.mark.parametrize(
    ("ablation", "base"), [("ours_without", "ours"), ("paper_with", "active_exploration")]
)
def test_an_ablation_of_the_learner_changes_one_part(ablation: str, base: str) -> None:
    methods = composed("+sweeps=learner").hydra.sweeper.params.method.replace(" ", "").split(",")
    parts = {m.split("/")[1] for m in methods if m.startswith(ablation)}
    beside = {"ours_without": set(), "paper_with": {"tuned_adam"}}[ablation]
    network = {"ours_without": set(), "paper_with": {"relative_positions"}}[ablation]  # only ours
    assert parts == {*CHANGED} - network | beside
    whole = composed("budget=small", f"method={base}")
    for part in parts - beside:
        group = CHANGED[part]
        config = composed("budget=small", f"method={ablation}/{part}")
        assert [key for key in CHANGED.values() if config[key] != whole[key]] == [
            key for key in CHANGED.values() if key == group
        ], part


@pytest.mark.parametrize(("of_the_paper", "of_ours"), WITH_OURS.items())
def test_claims_are_judged_with_the_same_samplings_and_our_learner(
    of_the_paper: str, of_ours: str
) -> None:
    """The paper's sampler, but for the number of its chains; all else is that of ours."""
    paper, ours, learner = (
        composed("budget=small", f"method={method}") for method in (of_the_paper, of_ours, "ours")
    )
    assert ours.sampler == {**paper.sampler, "chains": learner.sampler.chains}
    parts = ("model", "loss", "optimizer", "schedule", "averaging", "data", "renderer", "reuse")
    for part in (*parts, "resolution", "budget"):
        assert ours[part] == learner[part]


def test_runs_that_two_sweeps_need_are_one_run() -> None:
    arguments = ("budget=small", "scene=living-room", "method=active_exploration", "seed=1")
    one = composed("+sweeps=same_time", *arguments)
    for sweep in ("preconditioning", "resolution", "target_function", "acceptance"):
        other = composed(f"+sweeps={sweep}", *arguments)
        assert {key: one[key] for key in one if key not in ("hydra", "run")} == {
            key: other[key] for key in other if key not in ("hydra", "run")
        }


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
