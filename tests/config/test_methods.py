"""Every method differs from the others where its name says, and nowhere else."""

from dataclasses import replace
from typing import Any

import pytest
from hydra.utils import instantiate
from omegaconf import DictConfig, open_dict

from analysis.claims import WITH_OURS
from tests.config.command_line import CONF, composed

PRECONDITIONED, PLAIN = "pixel_generator", "pixel_generator_no_preconditioning"
COMPETITORS = ("cnsr", "anf")
"""Other methods, whose samples are of another size."""
EXPLORING = {
    "ours_exploring": "mcmc_loss_step",
    "ours_loss_target": "mcmc_loss",
    "ours_metropolis": "mcmc_metropolis",
}
IN_A_CLAIM = (
    "ours_exploring_growing",
    "ours_uniform_growing",
    "ours_learned_specular",
    "ours_paper_network",
    "ours_no_preconditioning",
)
"""Ours without what a claim of the paper is about."""
OURS = (
    *("ours", "ours_uniform", "ours_predicted", "ours_eager", "ours_predicted_from_buffers"),
    *("ours_supersampled", "ours_small_patches"),
    *(*EXPLORING, *IN_A_CLAIM),
)
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
    "ours_predicted": ("predicted_loss", "constant", "encoded_generator", LIGHT),
    "ours_eager": ("predicted_loss_eager", "constant", "encoded_generator", LIGHT),
    "ours_predicted_from_buffers": (
        *("predicted_from_buffers", "constant", "encoded_generator"),
        LIGHT,
    ),
    "ours_supersampled": ("sobol", "constant", "encoded_generator", LIGHT),
    "ours_small_patches": ("predicted_from_buffers", "constant", "encoded_generator", LIGHT),
    **{
        method: (sampler, "constant", "encoded_generator", LIGHT)
        for method, sampler in EXPLORING.items()
    },
    "ours_exploring_growing": ("mcmc_loss_step", "growing", "encoded_generator", LIGHT),
    "ours_uniform_growing": ("uniform", "growing", "encoded_generator", LIGHT),
    "ours_learned_specular": ("mcmc_loss_step", "constant", "encoded_generator", LIGHT[1:]),
    "ours_paper_network": ("mcmc_loss_step", "constant", PRECONDITIONED, LIGHT),
    "ours_no_preconditioning": ("mcmc_loss_step", "constant", PLAIN, LIGHT),
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
    assert config.renderer.halves == chosen.sampler.startswith("predicted_loss")
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
        "reuse": "by_loss" if method == "ours_eager" else "by_samples",
    }


def test_ours_trains_on_images_as_large_as_those_that_are_shown() -> None:
    for budget, shown in (("small", 96), ("paper", 256)):
        config = composed("method=ours", f"budget={budget}")
        schedule = instantiate(config.resolution)
        assert [schedule.resolution(step) for step in (0, 10**6)] == [shown, shown]


def test_supersampled_edges_are_all_that_makes_ours_supersampled() -> None:
    ours, finer = (composed("budget=small", f"method={m}") for m in ("ours", "ours_supersampled"))
    assert finer.data == {**ours.data, "supersampled_edges": True}
    for part in set(ours) - {"data", "label", "hydra"}:
        assert finer[part] == ours[part], part


def test_small_patches_are_as_many_pixels_of_more_scene_vectors() -> None:
    methods = ("ours_predicted_from_buffers", "ours_small_patches")
    large, small = (composed("budget=small", f"method={method}") for method in methods)
    assert 2 * small.renderer.patch_size == large.renderer.patch_size
    for of_batch in ("chains", "uniform_first"):
        assert small.sampler[of_batch] == 4 * large.sampler[of_batch]
        small.sampler[of_batch] = large.sampler[of_batch]
    assert small.sampler.candidates == 4 * 32, "of every scene vector one patch is traced"
    small.sampler.candidates = large.sampler.candidates
    small.renderer.patch_size = large.renderer.patch_size
    assert large.loss.mirrored, "or 6x6 of 16x16 pixels are the middle of a window of SSIM"
    for part in set(large) - {"label", "hydra"}:
        assert small[part] == large[part], part


def test_patches_are_the_cleaner_the_longer_a_budget_is() -> None:
    samples = [
        composed("method=ours", f"budget={budget}").renderer.samples_per_pixel
        for budget in ("smoke", "small", "machine", "hour")
    ]
    assert samples == [4, 32, 64, 256]
    assert composed("budget=paper").renderer.samples_per_pixel is None  # the scene's own


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


CHANGED = {
    "muon": ("optimizer", "_target_", "adam_lr", "clip_norm", "momentum"),
    "decay": ("schedule", "_target_", "decay_share", "final_factor", "warmup_steps"),
    "averaging": ("averaging", "_target_", "decay"),
    "encodings": (
        *("model", "_target_", "directions", "octaves", "position_preconditioning"),
        "relative",  # and emission as radiance, by the target
    ),
    "emission_as_radiance": ("model", "_target_"),
    "relative_positions": ("model", "relative"),
    "relative_loss": ("loss", "relative_weight"),
    "mirrored_windows": ("loss", "mirrored"),
    "camera_left_out": ("data", "camera"),
    "centred_patches": ("data", "centred"),
    "denoised_targets": ("data", "denoiser._target_", "traced_share"),
    "direct_light": ("renderer", "direct"),
    "caustics": ("renderer", "direct"),
    "specular_bounces": ("renderer", "specular"),
    "steady_reuse": (
        *("reuse", "policy._partial_", "policy._target_", "policy.beta", "policy.ema_coefficient"),
        *("policy.bootstrap_batches", "policy.times_at_32", "policy.stored_alone"),
        "store.rule._target_",
    ),
    "stored_alone": ("reuse", "policy.stored_alone"),
    "large_images": ("resolution", "start"),
    "small_batches": ("sampler", "chains"),
}
"""The group that each part of ours belongs to, and which of its keys it changes."""
OF_OURS_ALONE = {"emission_as_radiance", "relative_positions", "stored_alone"}
"""Parts that the paper's network or reuse has no place for."""
ALSO_CHANGED = {
    "paper_with/muon": {"optimizer.lr"},
    "paper_with/denoised_targets": {"data.camera", "data.centred"},  # said to be as they are
    "paper_with/large_images": {"resolution.step"},  # all through the run
}


def leaves(config: DictConfig) -> dict[str, Any]:
    """Dotted key -> value of all but how a run is called and where it lies."""
    found: dict[str, Any] = {}

    def collect(value: Any, *names: str) -> None:
        if isinstance(value, DictConfig) and value:
            for name in value:
                collect(value[name], *names, str(name))
        else:
            found[".".join(names)] = value

    for part in set(config) - {"hydra", "label", "run"}:
        collect(config[part], str(part))
    return found


def changed(method: str, whole: dict[str, Any]) -> set[str]:
    """Keys that this method or the whole one has alone, or with another value."""
    mine = leaves(composed("budget=small", f"method={method}"))
    same = {key for key in mine.keys() & whole.keys() if mine[key] == whole[key]}
    return (mine.keys() | whole.keys()) - same


@pytest.mark.parametrize(
    ("ablation", "base"), [("ours_without", "ours"), ("paper_with", "active_exploration")]
)
def test_an_ablation_of_the_learner_changes_one_part(ablation: str, base: str) -> None:
    methods = composed("+sweeps=learner").hydra.sweeper.params.method.replace(" ", "").split(",")
    parts = {m.split("/")[1] for m in methods if m.startswith(ablation)}
    beside = {"ours_without": set(), "paper_with": {"tuned_adam"}}[ablation]
    missing = {"ours_without": set(), "paper_with": OF_OURS_ALONE}[ablation]
    assert parts == {*CHANGED} - missing | beside
    whole = leaves(composed("budget=small", f"method={base}"))
    for part in parts - beside:
        method = f"{ablation}/{part}"
        group, *keys = CHANGED[part]
        expected = {f"{group}.{key}" for key in keys} | ALSO_CHANGED.get(method, set())
        assert changed(method, whole) == expected, part


def test_of_the_losses_terms_one_is_taken_out_or_added() -> None:
    ours, papers = (instantiate(composed(f"loss={name}").loss) for name in ("relative", "l1_dssim"))
    for part, of_ours, of_papers in (
        ("relative_loss", {"relative_weight": 0.0}, {"relative_weight": 1.0}),
        ("mirrored_windows", {"mirrored": False}, {"mirrored": True}),
    ):
        without = instantiate(composed(f"method=ours_without/{part}").loss)
        added = instantiate(composed(f"method=paper_with/{part}").loss)
        assert (without, added) == (replace(ours, **of_ours), replace(papers, **of_papers))
    assert replace(ours, relative_weight=0.0, mirrored=False) == papers


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


@pytest.mark.parametrize("method", ["ours_exploring_growing", "ours_uniform_growing"])
def test_with_our_learner_the_resolution_grows_as_with_the_papers(method: str) -> None:
    ours, papers = (
        composed("budget=small", f"method={name}") for name in (method, "active_exploration")
    )
    assert ours.resolution == papers.resolution
