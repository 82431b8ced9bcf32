import pytest
import torch
import torch.nn.functional as F

from ngi.models.pixel_mlp import NEGATIVE_SLOPE, PixelMLP


def make_mlp(*, patch_features=3, hidden_layers=4) -> PixelMLP:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        return PixelMLP(
            pixel_features=5,
            patch_features=patch_features,
            hidden_features=7,
            hidden_layers=hidden_layers,
            out_features=2,
        ).double()


def plain(mlp: PixelMLP, pixels: torch.Tensor, patch: torch.Tensor) -> torch.Tensor:
    """The same by PyTorch's own layers, one after the other."""
    constant = F.linear(patch, mlp.patch_weight, mlp.patch_bias)
    features = F.leaky_relu(F.linear(pixels, mlp.weights[0]) + constant[:, None], NEGATIVE_SLOPE)
    for number in range(1, len(mlp.weights)):
        if number == mlp.skip:
            features = torch.cat([features, pixels], dim=-1)
        features = F.linear(features, mlp.weights[number], mlp.biases[number - 1])
        if number < len(mlp.weights) - 1:
            features = F.leaky_relu(features, NEGATIVE_SLOPE)
    return features


@pytest.mark.parametrize(
    ("patches", "pixels", "options"),
    [
        (3, 4, {}),
        (2, 4, {"patch_features": 0}),
        (2, 4, {"hidden_layers": 1}),
        (1, 50, {}),
        (20, 3, {"hidden_layers": 2}),
    ],
)
def test_equals_plain_layers_with_all_gradients(patches, pixels, options) -> None:
    mlp = make_mlp(**options)
    generator = torch.Generator().manual_seed(1)
    shape = (patches, pixels, 5)
    x = torch.randn(shape, generator=generator, dtype=torch.float64, requires_grad=True)
    v = torch.randn(patches, options.get("patch_features", 3), generator=generator).double()
    v.requires_grad_()
    output, expected = mlp(x, v), plain(mlp, x, v)
    torch.testing.assert_close(output, expected, rtol=1e-12, atol=1e-13)
    weight = torch.randn(output.shape, generator=generator, dtype=torch.float64)
    variables = {
        "pixels": x,
        **({"patch": v} if v.shape[1] else {}),
        **dict(mlp.named_parameters()),
    }
    variables = {name: value for name, value in variables.items() if value.numel()}
    actual = torch.autograd.grad((output * weight).sum(), list(variables.values()))
    reference = torch.autograd.grad((expected * weight).sum(), list(variables.values()))
    for name, a, b in zip(variables, actual, reference, strict=True):
        torch.testing.assert_close(a, b, rtol=1e-10, atol=1e-11, msg=name)


def test_without_gradients_the_same_comes_out() -> None:
    mlp, x, v = make_mlp(), torch.rand(2, 6, 5).double(), torch.rand(2, 3).double()
    with torch.no_grad():
        without = mlp(x, v)
    assert torch.equal(without, mlp(x, v))


def test_bfloat16_is_close_and_its_gradients_are_float32() -> None:
    mlp = make_mlp().float()
    generator = torch.Generator().manual_seed(2)
    x = torch.randn(3, 700, 5, generator=generator)
    v = torch.rand(3, 3, generator=generator)
    reduced = mlp(x.bfloat16(), v)
    assert reduced.dtype == torch.bfloat16
    torch.testing.assert_close(reduced.float(), mlp(x, v), atol=0.03, rtol=0.03)
    reduced.float().square().sum().backward()
    of_reduced = [p.grad.clone() for p in mlp.parameters()]
    mlp.zero_grad()
    mlp(x, v).square().sum().backward()
    for a, b in zip(of_reduced, (p.grad for p in mlp.parameters()), strict=True):
        assert a.dtype == torch.float32
        assert (a - b).norm() <= 0.05 * b.norm()
