"""The denoiser ANF and the filters it is made of."""

import pytest
import torch
import torch.nn.functional as F
from torch import Tensor
from torch.autograd import gradcheck

from ngi.methods.anf.affinity import (
    neighbourhood,
    spatial_weights,
    temporal_weights,
    warped,
    weighted_mean,
)
from ngi.methods.anf.network import AffinityDenoiser
from ngi.methods.anf.unet import UNet, halved
from ngi.patches import BufferLayout

LAYOUT = BufferLayout(("position", "albedo"))


def numbers(*shape: int, seed: int = 0) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    return torch.rand(*shape, generator=generator, dtype=torch.float64)


def denoiser(**changes: object) -> AffinityDenoiser:
    sizes = {"hidden_features": 16, "hidden_layers": 4, "dilations": (1, 2), "kernel_size": 3}
    with torch.random.fork_rng():
        torch.manual_seed(0)
        return AffinityDenoiser(layout=LAYOUT, **{**sizes, **changes})  # type: ignore[arg-type]


def sequence(frames: int = 3, height: int = 12, width: int = 10) -> tuple[Tensor, Tensor, Tensor]:
    """Buffers, noisy log1p radiance, and a camera that stands still."""
    buffers = numbers(1, frames, height, width, LAYOUT.channels).float()
    noisy = numbers(1, frames, height, width, 3, seed=1).float()
    still = torch.arange(height * width).view(1, 1, height, width)
    return buffers, noisy, still.repeat(1, frames - 1, 1, 1)


@pytest.mark.parametrize(("size", "dilation"), [(3, 1), (3, 4), (5, 2)])
def test_a_filter_is_what_its_formula_says_pixel_by_pixel(size: int, dilation: int) -> None:
    f, a, c = numbers(1, 2, 9, 7), 5 * numbers(1, 1, 9, 7, seed=1), numbers(1, 1, 9, 7, seed=2)
    image = numbers(1, 3, 9, 7, seed=3)
    weights = spatial_weights(f, a, c, size=size, dilation=dilation)
    found = weighted_mean((image, weights), size=size, dilations=(dilation,))[0]
    reach = range(-(size // 2), size // 2 + 1)
    for y, x in ((0, 0), (4, 3), (8, 1)):
        total, weight = torch.zeros(3, dtype=torch.float64), 1e-10
        for v, u in ((y + dilation * i, x + dilation * j) for i in reach for j in reach):
            if 0 <= v < 9 and 0 <= u < 7:
                distance = (f[0, :, y, x] - f[0, :, v, u]).square().sum()
                w = torch.exp(-a[0, 0, y, x] * distance) if (v, u) != (y, x) else c[0, 0, y, x]
                total, weight = total + w * image[0, :, v, u], weight + w
        torch.testing.assert_close(found[:, y, x], total / weight)


def test_what_is_constant_stays_constant_up_to_the_border() -> None:
    weights = spatial_weights(
        numbers(2, 4, 9, 7), numbers(2, 1, 9, 7, seed=1), numbers(2, 1, 9, 7, seed=2),
        size=5, dilation=2,
    )  # fmt: skip
    constant = torch.full((2, 3, 9, 7), 0.7, dtype=torch.float64)
    torch.testing.assert_close(weighted_mean((constant, weights), size=5, dilations=(2,)), constant)
    net = denoiser()
    buffers, noisy, sources = sequence()
    torch.testing.assert_close(
        net(buffers, torch.full_like(noisy, 0.4), sources), torch.full_like(noisy, 0.4)
    )


def test_a_dilated_kernel_reaches_what_it_should_and_nothing_else() -> None:
    image = torch.zeros(1, 1, 15, 15, dtype=torch.float64)
    image[0, 0, 7, 7] = 1
    alike = torch.zeros(1, 1, 15, 15, dtype=torch.float64)
    weights = spatial_weights(alike, alike, alike + 1, size=3, dilation=4)
    reached = weighted_mean((image, weights), size=3, dilations=(4,))[0, 0].nonzero()
    assert reached.tolist() == [[y, x] for y in (3, 7, 11) for x in (3, 7, 11)]


def test_the_centre_weight_alone_decides_on_an_outlier() -> None:
    f, a = torch.zeros(1, 1, 5, 5), torch.zeros(1, 1, 5, 5)
    image = torch.ones(1, 1, 5, 5)
    image[0, 0, 2, 2] = 1000
    kept, dropped = (
        weighted_mean(
            (image, spatial_weights(f, a, torch.full_like(a, c), size=3, dilation=1)),
            size=3, dilations=(1,),
        )[0, 0, 2, 2]
        for c in (1.0, 0.0)
    )  # fmt: skip
    assert kept == pytest.approx((1000 + 8) / 9)
    assert dropped == pytest.approx(1)


def test_gradients_are_those_of_finite_differences() -> None:
    def filtered(f: Tensor, a: Tensor, c: Tensor, g: Tensor, image: Tensor) -> Tensor:
        spatial = spatial_weights(f, a, c, size=3, dilation=2)
        temporal = temporal_weights(f, g, a, size=3)
        return weighted_mean((image, spatial), (g[:, :1], temporal), size=3, dilations=(2, 1))

    channels = (2, 1, 1, 2, 1)
    inputs = [numbers(1, c, 4, 5, seed=s).requires_grad_() for s, c in enumerate(channels)]
    assert gradcheck(filtered, inputs)


def test_a_frame_before_is_found_where_it_was() -> None:
    image = numbers(1, 2, 4, 5)
    right = torch.arange(20).view(1, 4, 5) - 1
    right[:, :, 0] = -1
    moved, known = warped(image, right)
    assert torch.equal(moved[..., 1:], image[..., :-1])
    assert torch.equal(moved[..., 0], torch.zeros(1, 2, 4, dtype=torch.float64))
    assert torch.equal(known[0, 0].bool(), right[0] >= 0)


def test_temporal_weights_leave_out_what_is_not_known() -> None:
    f = torch.zeros(1, 1, 5, 5)
    known = torch.ones(1, 1, 5, 5)
    known[..., 3:] = 0
    weights = temporal_weights(f, f, f, known, size=3)
    assert weights[0, :, 2, 2].tolist() == [1, 1, 0] * 3
    assert weights[0, :, 0, 0].tolist() == [0, 0, 0, 0, 1, 1, 0, 1, 1]


def indifferent() -> AffinityDenoiser:
    """It tells f = 0, a = b = ln 2 and c = λ = 1/2 of every pixel."""
    net = denoiser()
    for parameter in net.unet.parameters():
        parameter.data.zero_()
    return net


def test_frames_before_count_in_radiance_and_in_output() -> None:
    """Eq. 5 gives the mean of both frames; Eq. 8 has 8 + c neighbours of it, and 9 of before."""
    buffers, noisy, sources = sequence(frames=2)
    before, now = 1.0, 3.0
    noisy[:, 0], noisy[:, 1] = torch.tensor([before, now]).log1p()
    output = torch.expm1(indifferent()(buffers, noisy, sources))[0, 1, 5, 5]
    expected = (8.5 * (before + now) / 2 + 9 * before) / 17.5
    torch.testing.assert_close(output, torch.full((3,), expected))


def test_a_still_camera_makes_every_frame_less_noisy() -> None:
    net = indifferent()
    buffers, _, _ = sequence(frames=6)
    noisy = torch.log1p(1 + 0.5 * torch.randn(1, 6, 12, 10, 3).abs())
    _, _, sources = sequence(frames=6)
    deviations = torch.expm1(net(buffers, noisy, sources)).std(dim=(0, 2, 3, 4))
    assert deviations[-1] < 0.8 * deviations[0]
    nowhere = torch.full_like(sources, -1)
    alone = net(buffers, noisy, nowhere)
    for frame in range(6):
        one = slice(frame, frame + 1)
        torch.testing.assert_close(
            alone[:, one], net(buffers[:, one], noisy[:, one], nowhere[:, :0])
        )


def test_what_is_shifted_comes_out_shifted() -> None:
    """By the coarsest level's pixel, away from the border."""
    net = denoiser(hidden_layers=2, dilations=(1,)).double()
    buffers, noisy = numbers(1, 1, 32, 32, LAYOUT.channels), numbers(1, 1, 32, 32, 3, seed=1)
    nothing = torch.empty(1, 0, 32, 32, dtype=torch.int64)
    shifted = net(buffers.roll(2, dims=3), noisy.roll(2, dims=3), nothing)
    inner = (slice(None), slice(None), slice(8, 24), slice(10, 24))
    torch.testing.assert_close(shifted[inner], net(buffers, noisy, nothing).roll(2, dims=3)[inner])


@pytest.mark.parametrize("size", [(8, 8), (9, 13)])
def test_a_unet_keeps_any_size_and_sees_around_the_corner(size: tuple[int, int]) -> None:
    net = UNet(inputs=2, outputs=5, widths=[4, 8, 8])
    x = torch.rand(3, 2, *size, requires_grad=True)
    y = net(x)
    assert y.shape == (3, 5, *size)
    y[0, :, 0, 0].sum().backward()
    assert x.grad is not None
    assert x.grad[0, :, 6, 6].abs().sum() > 0
    assert x.grad[1:].abs().sum() == 0


@pytest.mark.parametrize("order", [torch.contiguous_format, torch.channels_last])
def test_pixels_are_halved_as_by_pytorch_bit_for_bit(order: torch.memory_format) -> None:
    x = (4 * torch.rand(2, 3, 8, 6)).round().to(memory_format=order)  # many of them are alike
    pooled = []
    for pool in (halved, lambda image: F.max_pool2d(image, 2)):
        pixels = x.clone().requires_grad_()
        y = pool(pixels)
        (y * torch.arange(y.numel()).view(y.shape)).sum().backward()
        assert pixels.grad is not None
        pooled.append((y, pixels.grad))
    assert all(torch.equal(a, b) for a, b in zip(*pooled, strict=True))
    assert pooled[0][0].stride() == pooled[1][0].stride()


def test_it_learns_one_scene_by_heart() -> None:
    net = denoiser()
    buffers, _, sources = sequence(frames=2)
    edge = (torch.arange(10) > 4).float()[None, None, None, :, None].expand(1, 2, 12, 10, 3)
    truth = torch.log1p(0.2 + edge)
    buffers = torch.cat([buffers[..., :3], edge], dim=-1)
    noise = torch.randn(truth.shape, generator=torch.Generator().manual_seed(0))
    noisy = torch.log1p(torch.expm1(truth) * (1 + 0.8 * noise).clamp(min=0))
    optimizer = torch.optim.Adam(net.parameters(), lr=1e-2)
    before = (noisy - truth).abs().mean()
    for _ in range(60):
        loss = (net(buffers, noisy, sources) - truth).abs().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    assert loss < 0.3 * before


def test_a_rendered_frame_is_the_last_of_its_sequence() -> None:
    net = denoiser()
    buffers, noisy, sources = sequence()
    frame = net.render(buffers[0, -1], noisy[0], buffers[0, :-1], sources[0])
    torch.testing.assert_close(frame, net(buffers, noisy, sources)[0, -1])


def test_neighbours_are_counted_row_by_row() -> None:
    image = torch.arange(20.0).view(1, 1, 4, 5)
    around = neighbourhood(image, size=3, dilation=1)[0, 0, :, 1, 2]
    assert around.tolist() == [1, 2, 3, 6, 7, 8, 11, 12, 13]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"hidden_features": 3}, "model.hidden_features is 3"),
        ({"hidden_layers": 1}, "model.hidden_layers 1"),
        ({"kernel_size": 4}, "model.kernel_size is 4"),
        ({"dilations": ()}, r"model.dilations \[\]"),
        ({"dilations": (1, 0)}, r"model.dilations \[1, 0\]"),
    ],
)
def test_wrong_sizes_are_named(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        denoiser(**changes)


def test_frames_that_do_not_fit_are_refused() -> None:
    net = denoiser()
    buffers, noisy, sources = sequence()
    with pytest.raises(ValueError, match="expected 6 channels"):
        net(buffers[..., :5], noisy, sources)
    with pytest.raises(ValueError, match="of the same frames"):
        net(buffers, noisy[:, :2], sources)
    with pytest.raises(ValueError, match="of the same frames"):
        net(buffers, noisy, sources[:, :1])
