"""What of a pixel's light is taken from its buffers, in pixels that an emitter fills in part."""

import pytest
import torch

from ngi.models.known_light import add_known_light
from ngi.patches import BufferLayout

LAYOUT = BufferLayout(("position", "direct", "emission"))


def pixel(*, direct: float, emission: float) -> torch.Tensor:
    """[9] of a pixel whose radiances are these."""
    return torch.tensor([0.5, 0.5, 0.5, *3 * [direct], *3 * [emission]]).log1p()


def radiance(output: float, *, linear_emission: bool, **light: float) -> float:
    """Of such a pixel, where a network says `output`."""
    found = add_known_light(
        torch.full((3,), output), pixel(**light), LAYOUT, linear_emission=linear_emission
    ).expm1()
    assert (found == found[0]).all()
    return found[0].item()


@pytest.mark.parametrize("emission", [0.5, 5.0, 500.0])
def test_at_an_emitters_edge_the_rest_of_the_pixel_shows(emission: float) -> None:
    """The rest of it sends 0.2 of direct and 0.6 of indirect light, which a network has learnt."""
    learnt = torch.tensor(1.8 / 1.2).log().item()
    found = radiance(learnt, linear_emission=True, direct=0.2, emission=emission)
    assert found == pytest.approx(emission + 0.8, rel=1e-5)
    assert radiance(0.0, linear_emission=True, direct=0.2, emission=emission) == pytest.approx(
        emission + 0.2, rel=1e-5
    )


def test_an_error_of_the_network_does_not_scale_what_emits() -> None:
    found = radiance(0.01, linear_emission=True, direct=0.0, emission=500.0)
    assert found - 500 == pytest.approx(0.01, rel=0.05)


def test_as_in_the_release_a_bright_emitter_is_alone() -> None:
    found = radiance(0.3, linear_emission=False, direct=0.2, emission=5.0)
    assert found == pytest.approx(5.0, rel=1e-5)
    dim = radiance(0.3, linear_emission=False, direct=0.2, emission=1.5)
    assert dim == pytest.approx(2.7 * torch.tensor(0.3).exp().item() - 1, rel=1e-5)


@pytest.mark.parametrize("emission", [0.0, 5.0])
@pytest.mark.parametrize("output", [-200.0, -20.0, 0.0, 20.0])
def test_whatever_a_network_says_radiance_and_gradient_are_finite(
    output: float, emission: float
) -> None:
    said = torch.full((3,), output, requires_grad=True)
    found = add_known_light(
        said, pixel(direct=0.2, emission=emission), LAYOUT, linear_emission=True
    )
    assert found.isfinite().all()
    found.sum().backward()
    assert said.grad is not None
    if emission == 0:
        assert torch.equal(found, said + pixel(direct=0.2, emission=0)[3:6])
        assert (said.grad == 1).all()
    else:  # its share of the pixel's 1 + radiance
        share = 1.2 * said.detach().double().exp() / (1.2 * said.detach().double().exp() + 5)
        torch.testing.assert_close(said.grad.double(), share, rtol=1e-4, atol=1e-30)
