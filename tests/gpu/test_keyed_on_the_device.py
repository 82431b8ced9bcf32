"""What is kept under the name of a machine's device, and what is not (docs/explanation/gpu.md)."""

from pathlib import Path

import pytest
import torch
from hydra.utils import instantiate

from ngi.clock.costs import components
from ngi.config.build import plain
from ngi.evaluate.references import ReferenceCache, _content_key
from ngi.machine.precision import multiplies_bfloat16
from ngi.machine.provenance import provenance
from ngi.machine.size import network_depth, network_width
from ngi.render import AnalyticRenderer
from tests.gpu.machine import NAME, pretended_gpu
from tests.learn.composition import run_config


def keys() -> dict[str, str]:
    settings = plain(run_config("scene=mirror"))
    renderer = AnalyticRenderer(dimensions=3, patch_size=32)
    found = components(settings, renderer=renderer, scored=True, patches_per_vector=1)
    return {component.name: component.key for component in found}


def test_costs_of_every_component_are_those_of_one_device() -> None:
    without = keys()
    with pretended_gpu():
        on_gpu = keys()
    assert without.keys() == on_gpu.keys() == {"training", "exploring", "rendering", "scoring"}
    assert not {*without.values()} & {*on_gpu.values()}


@pytest.mark.usefixtures("gpu")
def test_costs_of_two_cards_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    first = keys()
    monkeypatch.setattr(torch.cuda, "get_device_name", lambda *_: "Another")
    assert not {*first.values()} & {*keys().values()}


def test_references_are_shared_by_all_devices(tmp_path: Path) -> None:
    """Their noise is stated; which backend rendered them is written into each."""
    protocol = instantiate(run_config("evaluation=smoke").evaluation.evaluator.protocol)
    renderer = AnalyticRenderer(dimensions=3, patch_size=32)
    v = renderer.hard_frames()[0]
    rendered = ReferenceCache(tmp_path).get(renderer, protocol, v)
    with pretended_gpu():
        assert _content_key(renderer, protocol, v) == rendered.key
        found = ReferenceCache(tmp_path).get(renderer, protocol, v.to("cuda").cpu())
    assert torch.equal(found.half_a, rendered.half_a)


@pytest.mark.usefixtures("gpu")
def test_a_result_names_the_card_and_sizes_are_the_papers() -> None:
    assert provenance(backend="none")["machine"]["gpu"] == NAME
    assert (network_width("auto"), network_depth("auto")) == (512, 8)


@pytest.mark.usefixtures("gpu")
def test_who_trains_on_the_processor_gets_its_size_and_precision() -> None:
    ours = ("method=ours", "budget=machine", "~renderer.direct", "~renderer.specular")
    by_accelerator = {name: run_config(*ours, f"trainer.accelerator={name}") for name in SIZES}
    assert {
        name: (config.model.hidden_features, config.model.hidden_layers)
        for name, config in by_accelerator.items()
    } == SIZES
    assert by_accelerator["auto"].trainer.precision == "bf16-mixed"
    expected = "bf16-mixed" if multiplies_bfloat16("cpu") else "32-true"
    assert by_accelerator["cpu"].trainer.precision == expected


SIZES = {"auto": (512, 8), "cpu": (128, 6)}
