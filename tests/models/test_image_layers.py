"""Whole images against the layers that train, and against float64."""

import pytest
import torch

from ngi.models import PixelGenerator, image_layers
from ngi.patches import BufferLayout

CASES = [
    {},
    {"hidden_features": 64, "names": BufferLayout().names},
    {"position_preconditioning": False},
    {"scene_dimensions": 0, "names": ("position",)},
    {"hidden_layers": 1, "negative_slope": 0.2},
    {"hidden_features": 17},
]


@pytest.fixture(params=[True, False], ids=["onednn", "pytorch"])
def library(request, monkeypatch) -> None:
    if not request.param:
        monkeypatch.setattr(image_layers, "computed_by_onednn", lambda _: False)


@pytest.mark.parametrize("options", CASES)
@pytest.mark.usefixtures("library")
def test_an_image_in_float32_is_that_of_the_layers_that_train(
    make_model, make_batch, options
) -> None:
    model = make_model(**options)
    batch = make_batch(model)
    with torch.no_grad():
        expected = model(batch.buffers, batch.scene_vector)
    for buffers, v, image in zip(batch.buffers, batch.scene_vector, expected, strict=True):
        torch.testing.assert_close(model.render(buffers, v), image, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("options", CASES)
@pytest.mark.usefixtures("library")
def test_an_image_in_bfloat16_is_no_less_exact_than_the_layers_that_train(
    make_model, make_batch, options
) -> None:
    model = make_model(**options)
    batch = make_batch(model, samples=1, height=64, width=64)
    with torch.no_grad(), torch.autocast("cpu", torch.bfloat16):
        trained = model(batch.buffers, batch.scene_vector)[0]
        shown = model.render(batch.buffers[0], batch.scene_vector[0])
    assert shown.dtype == torch.float32
    exact = model.double().render(batch.buffers[0].double(), batch.scene_vector[0].double())
    errors = [float((image - exact).square().mean().sqrt()) for image in (shown, trained)]
    assert errors[0] <= 1.02 * errors[1]
    torch.testing.assert_close(shown.double(), exact, rtol=1 / 64, atol=0.01)


def test_an_image_in_bfloat16_tells_neighbouring_positions_apart(make_model) -> None:
    model: PixelGenerator = make_model(names=("position",), hidden_features=64)
    buffers = torch.full((1, 2, 3), 0.7)
    buffers[:, 1] += 5e-4  # the nearest bfloat16 number is the same
    assert torch.equal(buffers[:, 0].bfloat16(), buffers[:, 1].bfloat16())
    rounded = image_layers.layer_inputs(buffers[0], torch.bfloat16)
    torch.testing.assert_close(rounded[:, :3].float() + rounded[:, 3:6].float(), buffers[0])
    first = image_layers.ImageLinear.of(model.input_layer, torch.zeros(0), torch.bfloat16)
    one, other = first(rounded)
    assert (one != other).sum() > 10
