"""What the tests' Hydra leaves out changes no configuration."""

import pytest
from hydra._internal import defaults_list
from omegaconf import OmegaConf, _utils, base
from omegaconf.grammar_parser import parse

from tests import quick_hydra
from tests.config.command_line import composed


def as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hydra and OmegaConf without `quick_hydra`, until a test ends."""
    monkeypatch.setattr(OmegaConf, "load", staticmethod(quick_hydra._load))
    monkeypatch.setattr(defaults_list, "_create_interpolation_map", quick_hydra._choices)
    for name, kind in zip(("is_dataclass", "is_attr_class"), quick_hydra._kinds, strict=True):
        monkeypatch.setattr(_utils, name, kind)
    for module in (base, _utils):
        monkeypatch.setattr(module, "parse", parse)


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("method=ours_small_patches", "budget=scarce", "scene=bathroom", "seed=3"),
        ("+sweeps=learner", "budget=small", "method=ours"),
        ("method=cnsr", "hydra/launcher=joblib"),
    ],
    ids=" ".join,
)
def test_a_configuration_is_the_same(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    quick = OmegaConf.to_yaml(composed(*words))
    as_they_are(monkeypatch)
    assert OmegaConf.to_yaml(composed(*words)) == quick
