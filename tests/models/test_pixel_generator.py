import math

import pytest
import torch
from torch import nn

from ngi.models import PatchLinear, PixelGenerator, pixel_generator
from ngi.patches import BUFFER_CHANNELS, BufferLayout

from .conftest import plain_forward

CASES = [
    {},
    {"position_preconditioning": False},
    {"scene_dimensions": 0},
    {"scene_dimensions": 0, "position_preconditioning": False},
    {"names": tuple(BUFFER_CHANNELS), "hidden_layers": 1},
    {"names": ("position",), "negative_slope": 0.2},
    {"names": ("position", "albedo"), "hidden_layers": 8},
    {"names": ("position", "direct", "emission")},
    {"names": ("position", "albedo", "direct")},
]


@pytest.mark.parametrize("options", CASES)
def test_equals_the_plain_concatenation_with_its_gradients(make_model, make_batch, options) -> None:
    model = make_model(**options).double()
    batch = make_batch(model)
    output = model(batch.buffers, batch.scene_vector)
    parameters = dict(model.named_parameters())
    expected = plain_forward(model, parameters, batch.buffers, batch.scene_vector)
    torch.testing.assert_close(output, expected, rtol=1e-12, atol=1e-13)
    weight = torch.linspace(-1, 1, output.numel(), dtype=torch.float64).view_as(output)
    actual = torch.autograd.grad((output * weight).sum(), list(parameters.values()))
    reference = torch.autograd.grad((expected * weight).sum(), list(parameters.values()))
    for name, a, b in zip(parameters, actual, reference, strict=True):
        torch.testing.assert_close(a, b, rtol=1e-11, atol=1e-13, msg=name)


def saved_elements(model, batch) -> int:
    total = 0

    def count(tensor):
        nonlocal total
        total += tensor.numel()
        return tensor

    with torch.autograd.graph.saved_tensors_hooks(count, lambda tensor: tensor):
        model(batch.buffers, batch.scene_vector)
    return total


def test_a_scene_vector_of_5000_is_not_repeated_at_every_pixel(make_model, make_batch) -> None:
    few, many = make_model(scene_dimensions=1), make_model(scene_dimensions=5000)
    size = {"height": 32, "width": 32}
    growth = saved_elements(many, make_batch(many, **size)) - saved_elements(
        few, make_batch(few, **size)
    )
    pixels = 3 * 32 * 32
    assert growth < 0.1 * pixels * 5000
    many = many.double()
    batch = make_batch(many)
    expected = plain_forward(many, dict(many.named_parameters()), batch.buffers, batch.scene_vector)
    torch.testing.assert_close(many(batch.buffers, batch.scene_vector), expected)


def test_initialised_as_a_linear_layer_on_the_concatenation() -> None:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        layer = PatchLinear(pixel_features=[20, 7], scene_dimensions=5, out_features=9)
        torch.manual_seed(0)
        plain = nn.Linear(32, 9)
    assert torch.equal(layer.weight, plain.weight)
    assert torch.equal(layer.bias, plain.bias)


def test_default_size_is_the_papers() -> None:
    model = PixelGenerator(layout=BufferLayout(), scene_dimensions=7)
    assert [list(layer.weight.shape) for layer in model.modules() if hasattr(layer, "weight")] == [
        [512, 3],
        *[[512, 512 + 13 + 7]] * 7,
        [3, 512 + 13 + 7],
    ]


def test_bright_emitters_show_themselves_and_dim_ones_add(make_model, make_batch) -> None:
    model = make_model()
    batch = make_batch(model)
    batch.buffers[..., -3:] = torch.tensor([1.5, 0.5, 0.0])
    output = model(batch.buffers, batch.scene_vector)
    batch.buffers[..., -3:] = 0
    dark = model(batch.buffers, batch.scene_vector)
    assert (output[..., 0] == 1.5).all()
    torch.testing.assert_close(output[..., 1], dark[..., 1] + 0.5)
    torch.testing.assert_close(output[..., 2], dark[..., 2])


def test_direct_light_is_an_input_and_is_added_as_radiance(make_model, make_batch) -> None:
    model = make_model(names=("position", "direct", "emission"))
    with torch.no_grad():
        model.output_layer.weight.zero_()
        model.output_layer.bias.copy_(torch.tensor([0.25, 0.0, -0.5]))
    batch = make_batch(model)
    direct, emitted = torch.tensor([3.0, 0.5, 0.0]), torch.tensor([0.7, 0.0, 2.5])  # radiance
    batch.buffers[..., 3:6], batch.buffers[..., 6:] = direct.log1p(), emitted.log1p()
    expected = torch.tensor([0.25 + math.log(4.7), math.log(1.5), math.log(3.5)])
    for image in (
        model(batch.buffers, batch.scene_vector),
        model.render(batch.buffers[0], batch.scene_vector[0]),
    ):
        torch.testing.assert_close(image, expected.expand_as(image))
    model = make_model(names=("position", "direct", "emission"))
    lit = model(batch.buffers, batch.scene_vector)
    batch.buffers[..., 3:6] = 0
    dark = model(batch.buffers, batch.scene_vector)
    learnt = (lit - dark)[..., 1] - math.log(1.5)
    assert learnt.abs().mean() > 1e-3, "the layers do not see it"


@pytest.mark.parametrize("names", [("position", "emission"), ("position", "direct", "emission")])
@pytest.mark.parametrize("pixels_per_chunk", [1, 7, 30, 1000])
def test_rendering_in_chunks_changes_nothing(
    make_model, make_batch, pixels_per_chunk, names, monkeypatch
) -> None:
    monkeypatch.setattr(pixel_generator, "CACHED_PIXELS", pixels_per_chunk)
    model = make_model(names=names).double()
    batch = make_batch(model, samples=1)
    image = model.render(batch.buffers[0], batch.scene_vector[0])
    assert not image.requires_grad
    expected = model(batch.buffers, batch.scene_vector)[0].detach()
    torch.testing.assert_close(image, expected, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("preconditioning", [True, False])
def test_bfloat16_is_close_to_float32_and_trains(make_model, make_batch, preconditioning) -> None:
    model = make_model(
        names=("position", "normal"), hidden_features=64, position_preconditioning=preconditioning
    )
    batch = make_batch(model)
    with torch.autocast("cpu", torch.bfloat16):
        output = model(batch.buffers, batch.scene_vector)
    assert output.dtype == torch.float32
    torch.testing.assert_close(
        output, model(batch.buffers, batch.scene_vector), atol=0.01, rtol=0.01
    )
    output.sum().backward()
    assert all(p.grad.dtype == torch.float32 for p in model.parameters())


def test_bfloat16_tells_neighbouring_positions_and_scenes_apart() -> None:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        layer = PatchLinear(pixel_features=[3], scene_dimensions=3, out_features=256)
    a = torch.full((1, 1, 3), 0.7)
    b = a + 5e-4  # the nearest bfloat16 number is the same
    v, w = a[0], b[0]
    with torch.autocast("cpu", torch.bfloat16):
        middle = layer((a,), v)
        by_position, by_scene = layer((b,), v) - middle, layer((a,), w) - middle
    exact = layer((b,), v) - layer((a,), v)
    assert torch.equal(a.bfloat16(), b.bfloat16())
    assert (by_position != 0).sum() > 10
    assert (by_scene != 0).sum() > 10
    assert torch.corrcoef(torch.stack([by_position.flatten(), exact.flatten()]))[0, 1] > 0.2


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"scene_dimensions": -1}, "scene_dimensions is -1"),
        ({"hidden_features": 0}, "hidden_features is 0"),
        ({"hidden_layers": 0}, "hidden_layers is 0"),
        ({"negative_slope": -0.1}, "negative_slope is -0.1"),
    ],
)
def test_bad_sizes_are_named(make_model, options, key) -> None:
    with pytest.raises(ValueError, match=key):
        make_model(**options)


def test_inputs_of_the_wrong_shape_are_named(make_model, make_batch) -> None:
    model = make_model()
    batch = make_batch(model)
    with pytest.raises(ValueError, match=r"scene vector of shape \[3, 3\]: expected \[3, 4\]"):
        model(batch.buffers, batch.scene_vector[:, :3])
    with pytest.raises(ValueError, match=r"scene vector of shape \[1, 4\]"):
        model(batch.buffers, batch.scene_vector[:1])
    with pytest.raises(ValueError, match=r"expected \[n, H, W, 10\]"):
        model(batch.buffers[..., :9], batch.scene_vector)
