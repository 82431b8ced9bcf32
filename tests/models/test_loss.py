import math

import numpy as np
import pytest
import torch
import torch.nn.functional as F
from skimage.metrics import structural_similarity

from ngi.models import L1Dssim

DSSIM = L1Dssim(l1_weight=0, dssim_weight=1)


def images(*shape: int, seed: int = 0, dtype: torch.dtype = torch.float64):
    generator = torch.Generator().manual_seed(seed)
    target = torch.rand(*shape, generator=generator, dtype=torch.float64).cumsum(1) / 8
    noise = torch.randn(*shape, generator=generator, dtype=torch.float64)
    return (target + 0.2 * noise).to(dtype), target.to(dtype)


def scikit_images(prediction: torch.Tensor, target: torch.Tensor, **options) -> list:
    """What `structural_similarity` gives for each image."""
    return [
        structural_similarity(
            p.numpy(),
            t.numpy(),
            channel_axis=-1,
            gaussian_weights=True,
            use_sample_covariance=False,
            **options,
        )
        for p, t in zip(prediction, target, strict=True)
    ]


@pytest.mark.parametrize("size", [(32, 32), (11, 11), (33, 20)])
@pytest.mark.parametrize("data_range", [1.0, 2.5])
def test_dssim_is_scikit_images(size, data_range) -> None:
    prediction, target = images(4, *size, 3)
    assert (prediction < 0).any()
    expected = scikit_images(prediction, target, data_range=data_range)
    loss = L1Dssim(l1_weight=0, dssim_weight=1, data_range=data_range)
    ssim = 1 - 2 * loss(prediction, target)
    torch.testing.assert_close(ssim, torch.tensor(expected), rtol=1e-10, atol=1e-12)
    ssim = 1 - 2 * loss(prediction.float(), target.float())
    torch.testing.assert_close(ssim.double(), torch.tensor(expected), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("size", [(32, 32), (16, 16), (11, 20)])
def test_mirrored_dssim_is_that_of_scikit_images_whole_map(size) -> None:
    prediction, target = images(4, *size, 3)
    maps = scikit_images(prediction, target, data_range=1, full=True)
    expected = [similarity.mean() for _, similarity in maps]
    loss = L1Dssim(l1_weight=0, dssim_weight=1, mirrored=True)
    ssim = 1 - 2 * loss(prediction, target)
    torch.testing.assert_close(ssim, torch.tensor(expected), rtol=1e-10, atol=1e-12)


def test_terms_are_weighted_and_samples_kept_apart() -> None:
    prediction, target = images(3, 16, 16, 3)
    l1 = (prediction - target).abs().mean(dim=(1, 2, 3))
    loss = L1Dssim(l1_weight=2, dssim_weight=3)
    torch.testing.assert_close(
        loss(prediction, target), 2 * l1 + 3 * DSSIM(prediction, target), rtol=1e-12, atol=0
    )
    torch.testing.assert_close(loss(prediction, target)[1:2], loss(prediction[1:2], target[1:2]))


@pytest.mark.parametrize("bright", [0.0, 1.0, 12.0])
def test_constant_patches_by_hand(bright) -> None:
    target = torch.full((1, 16, 16, 3), bright)
    other = bright + 0.5
    expected = (2 * bright * other + 1e-4) / (bright**2 + other**2 + 1e-4)
    actual = 1 - 2 * DSSIM(target + 0.5, target)
    torch.testing.assert_close(actual, torch.tensor([expected]), rtol=1e-5, atol=1e-5)
    assert DSSIM(target, target).item() == 0


def test_float32_stays_exact_on_bright_patches() -> None:
    prediction, target = images(2, 16, 16, 3)
    prediction, target = 12 + prediction / 30, 12 + target / 30
    torch.testing.assert_close(
        DSSIM(prediction.float(), target.float()).double(),
        DSSIM(prediction.float().double(), target.float().double()),
        rtol=1e-4,
        atol=0,
    )


def test_never_negative_next_to_the_target() -> None:
    _, target = images(64, 11, 11, 3, dtype=torch.float32)
    assert (DSSIM(target * (1 + 1e-7), target) >= 0).all()


@pytest.mark.parametrize("release_layout", [False, True])
def test_gradients(release_layout) -> None:
    prediction, target = images(2, 7, 6, 3)
    loss = L1Dssim(l1_weight=1, dssim_weight=1, window_size=5, release_layout=release_layout)
    assert torch.autograd.gradcheck(lambda p: loss(p, target), prediction.requires_grad_())


def test_computed_in_float32_under_autocast() -> None:
    prediction, target = images(2, 16, 16, 3, dtype=torch.float32)
    with torch.autocast("cpu", torch.bfloat16):
        actual = DSSIM(prediction, target)
        rounded = DSSIM(prediction.bfloat16(), target)
    assert actual.dtype == rounded.dtype == torch.float32
    assert torch.equal(actual, DSSIM(prediction, target))
    assert torch.equal(rounded, DSSIM(prediction.bfloat16().float(), target))


@pytest.mark.parametrize("offset", [0.03, 1.0, 2.5])
def test_relative_term_by_hand(offset) -> None:
    prediction, target = images(3, 16, 16, 3)
    loss = L1Dssim(l1_weight=0, dssim_weight=0, relative_weight=2, relative_offset=offset)
    wanted, given = (
        np.log(np.expm1(x.clamp(min=0).numpy()) + offset) for x in (target, prediction)
    )
    expected = 2 * np.abs(given - wanted).mean(axis=(1, 2, 3))
    torch.testing.assert_close(loss(prediction, target), torch.from_numpy(expected))


def test_half_the_light_is_missed_as_much_in_the_dark_as_in_the_bright() -> None:
    loss = L1Dssim(l1_weight=0, dssim_weight=0, relative_weight=1, relative_offset=1e-5)
    radiance = torch.tensor([0.01, 1.0, 1000.0])[:, None, None, None].expand(3, 11, 11, 3)
    torch.testing.assert_close(
        loss((radiance / 2).log1p(), radiance.log1p()),
        torch.full((3,), math.log(2)),
        rtol=0.01,
        atol=0,
    )


def test_relative_term_of_radiance_that_overflows_is_finite() -> None:
    loss = L1Dssim(l1_weight=0, dssim_weight=0, relative_weight=1)
    prediction = torch.full((1, 11, 11, 3), 200.0, requires_grad=True)  # log1p radiance
    value = loss(prediction, torch.full((1, 11, 11, 3), 190.0))
    value.sum().backward()
    assert value.item() == pytest.approx(10)
    assert prediction.grad is not None
    assert prediction.grad.sum().item() == pytest.approx(1)
    assert torch.isfinite(loss(torch.zeros(1, 11, 11, 3), torch.zeros(1, 11, 11, 3))).all()


def release_loss(prediction, target):
    """2·L1 + (1 − SSIM) with zero-padded convolutions over [n, P, P, 3] read as channels first."""
    window = torch.exp(-((torch.arange(11, dtype=torch.float64) - 5) ** 2) / (2 * 1.5**2))
    window = window / window.sum()
    channels = prediction.shape[1]
    kernel = torch.outer(window, window).expand(channels, 1, 11, 11)

    def blur(image):
        return F.conv2d(image, kernel, padding=5, groups=channels)

    mean_p, mean_t = blur(prediction), blur(target)
    var_p = blur(prediction**2) - mean_p**2
    var_t = blur(target**2) - mean_t**2
    covariance = blur(prediction * target) - mean_p * mean_t
    ssim = (2 * mean_p * mean_t + 1e-4) * (2 * covariance + 9e-4)
    ssim = ssim / ((mean_p**2 + mean_t**2 + 1e-4) * (var_p + var_t + 9e-4))
    return (2 * (prediction - target).abs() + 1 - ssim).mean(dim=(1, 2, 3))


def test_the_releases_loss() -> None:
    prediction, target = images(3, 32, 32, 3)
    loss = L1Dssim(l1_weight=2, dssim_weight=2, release_layout=True)
    torch.testing.assert_close(
        loss(prediction, target), release_loss(prediction, target), rtol=1e-10, atol=1e-12
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"l1_weight": -1}, "loss.l1_weight is -1"),
        ({"dssim_weight": -2}, "loss.dssim_weight is -2"),
        ({"relative_weight": -3}, "loss.relative_weight is -3"),
        ({"l1_weight": 0, "dssim_weight": 0}, "all weights of the loss are 0"),
        ({"window_size": 10}, "loss.window_size is 10"),
        ({"mirrored": True, "release_layout": True}, "loss.mirrored and loss.release.*zeros"),
        ({"sigma": 0}, "loss.sigma is 0"),
        ({"data_range": -1}, "loss.data_range is -1"),
        ({"relative_offset": 0}, "loss.relative_offset is 0"),
        ({"relative_offset": 1e-8}, "loss.relative_offset is 1e-08: it must be 1e-05 or more"),
    ],
)
def test_bad_options_are_named(options, message) -> None:
    with pytest.raises(ValueError, match=message):
        L1Dssim(**{"l1_weight": 1, "dssim_weight": 1, **options})


def test_patches_smaller_than_the_window_are_refused() -> None:
    with pytest.raises(ValueError, match=r"10 x 12 pixels.*loss.window_size \(it is 11\)"):
        DSSIM(torch.zeros(1, 12, 10, 3), torch.zeros(1, 12, 10, 3))
    with pytest.raises(ValueError, match="same shape"):
        DSSIM(torch.zeros(2, 12, 12, 3), torch.zeros(1, 12, 12, 3))
