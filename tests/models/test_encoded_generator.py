import math

import pytest
import torch
from hydra.utils import instantiate

from ngi.models import EncodedGenerator
from ngi.models.pixel_encoding import PixelEncoding
from ngi.patches import BUFFER_CHANNELS, BufferLayout, MovingPoints
from tests.learn.composition import run_config

LAYOUT = BufferLayout()
STILL = MovingPoints.none(4)
V = torch.zeros(1, 4)


def make_generator(**options) -> EncodedGenerator:
    sizes = {"hidden_features": 16, "hidden_layers": 3, "octaves": 2, "directions": True}
    with torch.random.fork_rng():
        torch.manual_seed(0)
        return EncodedGenerator(
            **{"layout": LAYOUT, "scene_dimensions": 4, **sizes, **options}  # type: ignore[arg-type]
        )


def make_buffers(*shape: int, layout: BufferLayout = LAYOUT) -> torch.Tensor:
    return torch.rand(*shape, layout.channels, generator=torch.Generator().manual_seed(1))


def test_the_encoding_is_what_its_formulas_say() -> None:
    encoding = PixelEncoding(layout=LAYOUT, octaves=3, directions=True, moving=STILL)
    buffers = make_buffers(5)
    normal = torch.nn.functional.normalize(torch.randn(5, 3), dim=1)
    outgoing = torch.nn.functional.normalize(torch.randn(5, 3), dim=1)
    buffers[:, LAYOUT.slice("normal")] = normal / 2 + 0.5
    buffers[:, LAYOUT.slice("outgoing")] = outgoing
    position = buffers[:, :3].double() - 0.5
    angles = [math.pi * 2**octave * position for octave in range(3)]
    mirrored = torch.stack(  # Householder's matrix turns the direction about the normal
        [(2 * torch.outer(n, n) - torch.eye(3)) @ w for n, w in zip(normal, outgoing, strict=True)]
    )
    expected = [
        2 * position,
        buffers[:, 3 : LAYOUT.input_channels],
        *(wave(angle) for angle in angles for wave in (torch.sin, torch.cos)),
        mirrored,
        (normal * outgoing).sum(dim=1, keepdim=True),
    ]
    features = encoding(buffers[None], V, torch.float32)[0]
    columns = torch.cat([part.float() for part in expected], dim=1)
    torch.testing.assert_close(features[:, : columns.shape[1]], columns, atol=2e-6, rtol=0)
    assert features.shape[1] == encoding.features
    assert encoding.features % 8 == 0
    assert (features[:, columns.shape[1] :] == 0).all()


def test_offset_distance_direction_and_cosine_to_what_moves_are_told() -> None:
    """Against the same in the units of a scene whose box is not a cube."""
    low, sides = torch.tensor([-1.0, 0.5, 2.0]), torch.tensor([4.0, 1.0, 2.0])
    start, step = torch.tensor([0.0, 1.0, 3.0]), torch.tensor([[2.0, 0, 0], [0.5, 0.25, 0]])
    moving = MovingPoints(
        weight=(step / sides).T[None], offset=((start - low) / sides)[None], extent=sides / 4
    )
    layout = BufferLayout(("position", "normal"))
    sizes = {"layout": layout, "octaves": 0, "directions": False}
    encoding = PixelEncoding(**sizes, moving=moving)  # type: ignore[arg-type]
    buffers = make_buffers(2, 5, layout=layout)
    v = torch.tensor([[0.5, 0.25], [1.0, 0.0]])
    here = low + sides * buffers[..., :3]
    away = (start + v @ step)[:, None] - here
    distance = away.norm(dim=-1, keepdim=True)
    normal = 2 * buffers[..., 3:] - 1
    cosine = (away / distance * normal).sum(dim=-1, keepdim=True)
    expected = torch.cat([away / 2, distance / 2, away / distance, cosine], dim=-1)
    features = encoding(buffers, v, torch.float32)
    torch.testing.assert_close(features[..., 6:14], expected, atol=1e-6, rtol=0)
    buffers[0, 0, :3] = (start + v[0] @ step - low) / sides  # a pixel at the point itself
    at_it = encoding(buffers, v, torch.float32)[0, 0, 6:14]
    torch.testing.assert_close(at_it, torch.zeros(8), atol=1e-3, rtol=0)


def test_what_moves_is_told_where_it_is_wanted() -> None:
    moving = MovingPoints(torch.rand(2, 3, 4), torch.rand(2, 3), torch.ones(3))
    without = make_generator()
    assert make_generator(moving=moving).encoding.features == without.encoding.features
    told = make_generator(moving=moving, relative=True)
    assert told.encoding.features == without.encoding.features + 16
    assert without.state_dict().keys() < told.state_dict().keys()
    buffers = make_buffers(2, 8, 8)
    v = torch.rand(2, 4)
    restored = make_generator(moving=MovingPoints(*map(torch.zeros_like, vars(moving).values())),
                              relative=True)  # fmt: skip
    restored.load_state_dict(told.state_dict())
    assert torch.equal(restored(buffers, v), told(buffers, v))


def test_bfloat16_tells_neighbouring_positions_apart() -> None:
    encoding = PixelEncoding(layout=LAYOUT, octaves=4, directions=False, moving=STILL)
    apart = make_buffers(100)
    apart[:, :3] = apart[:, :3] * 0.9
    beside = apart.clone()
    beside[:, :3] += 1 / 2000
    assert (apart[:, 0].bfloat16() == beside[:, 0].bfloat16()).sum() > 50
    features = [encoding(pixels[None], V, torch.bfloat16) for pixels in (apart, beside)]
    differ = (features[0] != features[1]).any(dim=2)
    assert differ.all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"octaves": -1}, "model.octaves is -1"),
        ({"layout": BufferLayout(("position", "normal"))}, r"lack \['outgoing'\]"),
        ({"hidden_features": 0}, "model.hidden_features is 0"),
        ({"hidden_layers": 0}, "model.hidden_layers is 0"),
    ],
)
def test_bad_options_are_named(options, message) -> None:
    with pytest.raises(ValueError, match=message):
        make_generator(**options)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"scene_dimensions": 0},
        {"octaves": 0, "directions": False, "layout": BufferLayout(("position",))},
        {"hidden_layers": 1},
    ],
)
def test_an_image_is_what_its_pixels_are(options) -> None:
    network = make_generator(**options)
    buffers = make_buffers(6, 7, layout=network.layout)
    v = torch.rand(network.scene_dimensions)
    image = network.render(buffers, v)
    assert not image.requires_grad
    torch.testing.assert_close(image, network(buffers[None], v[None])[0], atol=1e-6, rtol=0)
    turned = network.render(buffers.transpose(0, 1), v)
    torch.testing.assert_close(turned.transpose(0, 1), image, atol=1e-6, rtol=0)


def test_emission_is_passed_through() -> None:
    network, buffers = make_generator(), make_buffers(1, 4, 4)
    v = torch.rand(1, 4)
    buffers[..., LAYOUT.slice("emission")] = torch.tensor([1.5, 0.5, 0.0])
    output = network(buffers, v)
    buffers[..., LAYOUT.slice("emission")] = 0
    dark = network(buffers, v)
    assert (output[..., 0] == 1.5).all()
    torch.testing.assert_close(output[..., 1], dark[..., 1] + 0.5)
    torch.testing.assert_close(output[..., 2], dark[..., 2])


@pytest.mark.parametrize(
    ("model", "radiance"),
    [("encoded_generator", 5.2), ("encoded_generator_emitters_alone", 5.0)],
)
def test_direct_light_beside_an_emitter_shows_where_the_model_says_so(
    model: str, radiance: float
) -> None:
    """The network says nothing; direct light is 0.2, emission 5."""
    config = run_config(f"model={model}", "model.hidden_features=16").model
    layout = BufferLayout(("position", "normal", "outgoing", "direct", "emission"))
    network = instantiate(config)(layout=layout, scene_dimensions=4)
    for parameter in (network.mlp.weights[-1], network.mlp.biases[-1]):
        torch.nn.init.zeros_(parameter)
    buffers = make_buffers(6, 7, layout=layout)
    buffers[..., layout.slice("direct")] = math.log(1.2)
    buffers[..., layout.slice("emission")] = math.log(6)
    for output in (network(buffers[None], V)[0], network.render(buffers, V[0])):
        torch.testing.assert_close(output.expm1(), torch.full((6, 7, 3), radiance))


def test_reduced_precision_is_close_and_trains() -> None:
    network, buffers = make_generator(hidden_features=64), make_buffers(2, 8, 8)
    v = torch.rand(2, 4)
    with torch.autocast("cpu", torch.bfloat16):
        output = network(buffers, v)
    assert output.dtype == torch.float32
    torch.testing.assert_close(output, network(buffers, v), atol=0.02, rtol=0.02)
    output.sum().backward()
    assert all(p.grad is not None and p.grad.isfinite().all() for p in network.parameters())


def test_wrong_shapes_are_named() -> None:
    network, buffers = make_generator(), make_buffers(2, 8, 8)
    with pytest.raises(ValueError, match=r"scene vector of shape \[2, 3\]"):
        network(buffers, torch.rand(2, 3))
    with pytest.raises(ValueError, match=f"expected \\[n, H, W, {sum(BUFFER_CHANNELS.values())}"):
        network(buffers[..., 1:], torch.rand(2, 4))
