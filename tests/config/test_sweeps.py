"""Sweeps: their commands, scenes and methods are there, at every budget."""

from functools import cache

import pytest
import yaml
from hydra.utils import instantiate

from ngi.config.build import reuse_policy
from ngi.config.configuration import sweep_names
from ngi.config.values import check_values
from ngi.files.resources import root
from ngi.learn import PatchSamples, network_of
from ngi.render import AnalyticRenderer
from ngi.reuse import PolicyState
from tests.config.command_line import composed

BUDGETS = ("smoke", "small", "paper")
SWEEPS = [file.stem for file in sorted((root() / "sweeps").glob("*.yaml"))]
OF_ONE_SIZE = (
    "dear",
    "demo",
    "learner",
    "minute",
    "needed",
    "ours_hour",
    "ours_predicted",
    "rare",
    "smoke",
    "stability",
)
"""Sweeps that are no table or figure of the paper."""


@pytest.mark.parametrize("sweep", SWEEPS)
def test_every_sweep_says_its_command(sweep: str) -> None:
    text = (root() / "sweeps" / f"{sweep}.yaml").read_text()
    assert f"python -m ngi.train -m +sweeps={sweep}" in text.splitlines()[1]
    assert composed(f"+sweeps={sweep}").hydra.sweeper.params


@pytest.mark.parametrize("sweep", SWEEPS)
def test_every_key_that_a_sweep_adds_is_read(sweep: str) -> None:
    check_values(composed(f"+sweeps={sweep}"))


def test_help_names_every_sweep() -> None:
    assert sweep_names().replace(",", " ").split() == SWEEPS


OF_THE_PAPER = [sweep for sweep in SWEEPS if sweep not in OF_ONE_SIZE]


@pytest.mark.parametrize("sweep", SWEEPS)
def test_every_scene_of_a_sweep_is_there(sweep: str) -> None:
    scenes = composed(f"+sweeps={sweep}").hydra.sweeper.params.get("scene", "")
    for scene in scenes.split(",") if scenes else ():
        assert name_of(scene, *own_words(sweep)) == scene


@pytest.mark.parametrize("sweep", ["dear", "minute", "ours_hour", "rare"])
def test_runs_of_these_are_not_in_the_way_of_plain_ones(sweep: str) -> None:
    folders = [
        composed(*words, "scene=mirror", "method=ours").run.folder
        for words in (
            ["budget=small"],
            [f"+sweeps={sweep}", "budget=small"],
            [f"+sweeps={sweep}", "budget=smoke"],
        )
    ]
    assert len(set(folders)) == 3


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
    for part in (config.sampler, config.resolution, config.budget):
        instantiate(part)
    assert reuse_policy(config, samples_per_pixel=32).init() == PolicyState()
    samples = PatchSamples(renderer=AnalyticRenderer(dimensions=3, patch_size=16))
    assert network_of(samples, instantiate(config.model)) is not None


def test_runs_that_two_sweeps_need_are_one_run() -> None:
    arguments = ("budget=small", "scene=living-room", "method=active_exploration", "seed=1")
    one = composed("+sweeps=same_time", *arguments)
    for sweep in ("preconditioning", "resolution", "target_function", "acceptance"):
        other = composed(f"+sweeps={sweep}", *arguments)
        assert {key: one[key] for key in one if key not in ("hydra", "run")} == {
            key: other[key] for key in other if key not in ("hydra", "run")
        }
