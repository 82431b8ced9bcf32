"""The network of CNSR against its parts in plain PyTorch, and what it must not depend on."""

import pytest
import torch
import torch.nn.functional as F
from torch import Tensor, nn

from ngi.methods.cnsr import CNSR
from ngi.patches import BufferLayout

LAYOUT = BufferLayout(("position", "normal", "emission"))
CHANNELS = LAYOUT.channels + 3


def network(**options) -> CNSR:
    options = {"hidden_features": 16, "hidden_layers": 3, **options}
    with torch.random.fork_rng():
        torch.manual_seed(2)
        return CNSR(layout=LAYOUT, **options)


def inputs(n: int = 2, k: int = 3, size: int = 8, dtype=torch.float64) -> tuple[Tensor, ...]:
    generator = torch.Generator().manual_seed(4)
    shapes = (n, 6, 5, LAYOUT.channels), (n, 6), (n, k, size, size, CHANNELS), (n, k, 6)
    return tuple(torch.rand(*s, generator=generator, dtype=torch.float64).to(dtype) for s in shapes)


def plain_code(model: CNSR, observation: Tensor, camera: Tensor) -> Tensor:
    """One observation, channels first, layer by layer as in the program of Granskog et al."""
    parts = model.encoder

    def layer(conv: nn.Conv2d, x: Tensor, **options) -> Tensor:
        return F.relu(F.conv2d(x, conv.weight, conv.bias, **options))

    skip_in = layer(parts.halve, observation[None], stride=2)
    x = layer(parts.first, skip_in, padding=1)
    x = layer(parts.quarter, x, stride=2) + layer(parts.first_skip, skip_in, stride=2)
    v = camera.reshape(1, 6, 1, 1).repeat(1, 1, *x.shape[2:])
    skip_in = torch.cat([x, v], dim=1)
    x = layer(parts.second, skip_in, padding=1)
    x = layer(parts.third, x, padding=1) + layer(parts.second_skip, skip_in, padding=1)
    x = layer(parts.last, x)
    return F.avg_pool2d(x, x.shape[-1]).flatten()


def test_the_representation_is_the_mean_over_the_observations_codes() -> None:
    model = network().double()
    _, _, observations, cameras = inputs()
    expected = torch.stack(
        [
            torch.stack(
                [
                    plain_code(model, image.permute(2, 0, 1), camera)
                    for image, camera in zip(*of_set, strict=True)
                ]
            ).mean(0)
            for of_set in zip(observations, cameras, strict=True)
        ]
    )
    assert expected.shape == (2, 8)
    torch.testing.assert_close(model.represent(observations, cameras), expected)


def test_the_representation_and_the_querys_camera_stand_where_v_does() -> None:
    model = network().double()
    buffers, camera, observations, cameras = inputs()
    v = torch.cat([model.represent(observations, cameras), camera], dim=1)
    expected = model.generator(buffers, v)
    assert expected.shape == (2, 6, 5, 3)
    assert torch.equal(model(buffers, camera, observations, cameras), expected)


def test_the_gradient_is_that_of_finite_differences() -> None:
    model = network().double()
    arguments = inputs(n=1, k=2, size=4)
    names, values = zip(*model.named_parameters(), strict=True)

    def loss(*parameters: Tensor) -> Tensor:
        called = torch.func.functional_call(
            model, dict(zip(names, parameters, strict=True)), arguments
        )
        return called.square().mean()

    detached = tuple(value.detach().clone().requires_grad_() for value in values)
    assert torch.autograd.gradcheck(loss, detached, fast_mode=True)
    loss(*detached).backward()
    assert all(value.grad.abs().max() > 0 for value in detached), "a part of it is never used"


def test_the_order_of_the_observations_does_not_matter() -> None:
    model = network().double()
    buffers, camera, observations, cameras = inputs()
    order = torch.tensor([2, 0, 1])
    torch.testing.assert_close(
        model(buffers, camera, observations[:, order], cameras[:, order]),
        model(buffers, camera, observations, cameras),
        rtol=1e-13,
        atol=1e-13,
    )
    mixed = model(buffers, camera, observations[:, order], cameras)
    assert not torch.allclose(mixed, model(buffers, camera, observations, cameras))


@pytest.mark.parametrize("size", [8, 16])
def test_a_whole_image_is_the_same_as_in_training(size: int) -> None:
    model = network()
    arguments = inputs(size=size, dtype=torch.float32)
    rendered = model.render(*(tensor[1] for tensor in arguments))
    assert not rendered.requires_grad
    torch.testing.assert_close(rendered, model(*arguments)[1], rtol=1e-5, atol=1e-5)


def test_training_in_bfloat16_is_close_to_float32() -> None:
    model, arguments = network(), inputs(dtype=torch.float32)
    with torch.autocast("cpu", torch.bfloat16):
        reduced, image = model(*arguments), model.render(*(t[0] for t in arguments))
    assert reduced.dtype == torch.float32
    expected = model(*arguments)
    torch.testing.assert_close(reduced, expected, rtol=0.02, atol=0.02)
    torch.testing.assert_close(image, expected[0], rtol=0.02, atol=0.02)


def test_its_size_is_that_of_their_program() -> None:
    model = CNSR(layout=LAYOUT)
    shapes = [list(p.shape) for n, p in model.encoder.named_parameters() if n.endswith("weight")]
    assert shapes == [
        [256, CHANNELS, 2, 2],
        [256, 256, 2, 2],
        [128, 256, 3, 3],
        [256, 128, 2, 2],
        [256, 262, 3, 3],
        [128, 262, 3, 3],
        [256, 128, 3, 3],
        [256, 256, 1, 1],
    ]
    assert len(model.generator.hidden) + 1 == 11
    assert model.generator.hidden[0].out_features == 512


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda b, c, o, k: (b, c, o[..., :-1], k), "expected 12"),
        (lambda b, c, o, k: (b, c, o[:, :, :6, :6], k), "6 x 6 pixels"),
        (lambda b, c, o, k: (b, c, o, k[:, :2]), r"cameras of shape \[2, 2, 6\]"),
        (lambda b, c, o, k: (b, c[:, :3], o, k), "scene vector of shape"),
    ],
)
def test_inputs_that_do_not_fit_are_refused(change, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        network()(*change(*inputs(dtype=torch.float32)))


@pytest.mark.parametrize("features", [0, 2, 18])
def test_a_width_that_cannot_be_quartered_is_refused(features: int) -> None:
    with pytest.raises(ValueError, match=f"model.hidden_features is {features}"):
        network(hidden_features=features)
