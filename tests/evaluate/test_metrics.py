import dataclasses

import numpy as np
import pytest
import torch
from skimage import color
from skimage.metrics import structural_similarity

from ngi.evaluate import dssim, image_metrics, mae, mape, non_finite_pixels, relmse, tone_map

SIZES = [(11, 11), (13, 37), (64, 65)]


def images(height: int, width: int) -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(height * width)
    x = torch.rand(height, width, 3, generator=generator)
    return x, (x + 0.2 * torch.randn(x.shape, generator=generator)).clamp(0, 1)


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_dssim_is_that_of_scikit_image(height: int, width: int) -> None:
    x, y = images(height, width)
    expected = structural_similarity(
        x.double().numpy(),
        y.double().numpy(),
        data_range=1.0,
        channel_axis=-1,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
    )
    assert dssim(x, y) == pytest.approx((1 - expected) / 2, abs=1e-9)


def test_dssim_of_another_window_is_that_of_a_loop() -> None:
    x, y = (image.double().numpy() for image in images(9, 12))
    offset = np.arange(-2, 3)
    weight = np.exp(-(offset[:, None] ** 2 + offset[None, :] ** 2) / (2 * 0.8**2))
    weight /= weight.sum()
    values = []
    for channel in range(3):
        for i in range(9 - 4):
            for j in range(12 - 4):
                a, b = x[i : i + 5, j : j + 5, channel], y[i : i + 5, j : j + 5, channel]
                ma, mb = (weight * a).sum(), (weight * b).sum()
                va, vb = (weight * (a - ma) ** 2).sum(), (weight * (b - mb) ** 2).sum()
                cov = (weight * (a - ma) * (b - mb)).sum()
                luminance = (2 * ma * mb + 1e-4) / (ma**2 + mb**2 + 1e-4)
                values.append(luminance * (2 * cov + 9e-4) / (va + vb + 9e-4))
    result = dssim(torch.from_numpy(x), torch.from_numpy(y), window=5, sigma=0.8)
    assert result == pytest.approx((1 - np.mean(values)) / 2, abs=1e-10)


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_relative_and_absolute_error_are_those_of_numpy(height: int, width: int) -> None:
    x, y = images(height, width)
    difference = np.abs(x.double().numpy() - y.double().numpy())
    assert mape(x, y, 0.01) == pytest.approx(
        np.mean(difference / (y.double().numpy() + 0.01)), rel=1e-12
    )
    assert mae(x, y) == pytest.approx(np.mean(difference), rel=1e-12)


def test_relative_error_of_a_black_reference_is_relative_to_epsilon() -> None:
    black = torch.zeros(4, 4, 3)
    assert mape(torch.full((4, 4, 3), 0.02), black, 0.01) == pytest.approx(2.0)


def test_relmse_of_a_reference_without_noise_is_that_of_numpy() -> None:
    x, y = images(16, 24)
    p, r = x.double().numpy(), y.double().numpy()
    assert relmse(x, y, y) == pytest.approx(np.mean((p - r) ** 2 / (r**2 + 0.01)), rel=1e-12)


def test_relmse_leaves_out_the_worst_pixel_of_a_thousand() -> None:
    x, y = images(40, 50)
    expected = relmse(x, y, y)
    x[3, 4], x[30, 9] = 1000.0, 1000.0  # two of 2,000
    assert relmse(x, y, y) == pytest.approx(expected, rel=0.05)
    x[5, 6] = 1000.0
    assert relmse(x, y, y) > 100 * expected


def relmse_with_and_without_noise(error: torch.Tensor) -> tuple[float, float, float]:
    """Of a prediction that is so much too bright; of it without, with halved and all the noise."""
    generator = torch.Generator().manual_seed(0)
    truth = 0.5 + torch.rand(256, 256, 3, generator=generator)
    a, b = truth * (1 + 0.1 * torch.randn(2, 256, 256, 3, generator=generator))
    mean = 0.5 * (a + b)
    prediction = truth * (1 + error)
    pairs = ((truth, truth), (a, b), (mean, mean))
    without, halved, noisy = (relmse(prediction, *pair) for pair in pairs)
    return without, halved, noisy


@pytest.mark.parametrize("error", [0.0, 0.03, 0.1])
def test_the_references_noise_adds_next_to_nothing_to_relmse(error: float) -> None:
    signs = torch.arange(256).div(8, rounding_mode="floor") % 2 * 2.0 - 1
    stripes = error * signs.view(1, 256, 1)
    without, halved, noisy = relmse_with_and_without_noise(stripes)
    assert noisy - without == pytest.approx(0.1**2 / 2, rel=0.1)
    assert abs(halved - without) < 0.1 * (noisy - without)


def test_what_is_too_bright_everywhere_has_that_share_of_the_noise_in_relmse() -> None:
    error = 0.1
    without, halved, _ = relmse_with_and_without_noise(torch.tensor(error))
    assert halved - without == pytest.approx(4 * error * 0.1**2 / 2, rel=0.25)


def test_relmse_sees_the_worst_of_bright_and_dark_alike() -> None:
    """A lamp that is missing counts 1, one in the dark where none is by its own square."""
    lamp, dark = torch.full((2, 2, 3), 100.0), torch.zeros(2, 2, 3)
    assert relmse(dark, lamp, lamp) == pytest.approx(1, rel=1e-5)
    assert relmse(lamp, dark, dark) == pytest.approx(100**2 / 0.01)


def test_equal_images_have_no_error() -> None:
    x, _ = images(16, 16)
    assert (mape(x, x, 0.01), mae(x, x), dssim(x, x)) == (0.0, 0.0, pytest.approx(0.0, abs=1e-12))


def test_dssim_of_noise_on_a_smooth_picture() -> None:
    # As `Reference.radiance` says: the floor is too low, by a factor of at most 3.
    C2 = 0.03**2
    generator = torch.Generator().manual_seed(0)
    truth = torch.full((256, 256, 3), 0.5, dtype=torch.float64)
    for s in (0.01 * C2, C2, 10 * C2):
        a, b = (
            truth + (2 * s) ** 0.5 * torch.randn(truth.shape, generator=generator) for _ in range(2)
        )
        mean = (a + b) / 2
        assert dssim(truth, mean) == pytest.approx(0.5 * s / (s + C2), rel=0.1)
        assert dssim(a, mean) == pytest.approx(0.5 * s / (3 * s + C2), rel=0.1)


def test_tone_map_is_the_srgb_curve_of_scikit_image() -> None:
    linear = torch.linspace(0, 1, 3000).reshape(-1, 3).double()
    xyz = np.tensordot(linear.numpy(), color.rgb2xyz(np.eye(3)[None])[0], axes=1)
    np.testing.assert_allclose(tone_map(linear).numpy(), color.xyz2rgb(xyz), atol=2e-4)


def test_tone_map_exposes_in_stops_and_clips() -> None:
    radiance = torch.tensor([[-1.0, 0.125, 3.0]])
    assert torch.equal(tone_map(radiance, exposure=1.0), tone_map(torch.tensor([[0.0, 0.25, 1.0]])))


class LpipsWithoutWeights:
    """Stands where LPIPS does, and keeps what it is given."""

    available = True
    given: tuple[torch.Tensor, torch.Tensor]

    def __call__(self, prediction: torch.Tensor, reference: torch.Tensor) -> float:
        self.given = prediction, reference
        return 0.125


def test_relative_and_absolute_errors_are_of_radiance_and_the_others_of_pictures(protocol) -> None:
    """For a sigma of 0.7 scikit-image takes a window of 2 int(3.5 * 0.7 + 0.5) + 1 = 5 pixels."""
    p, r = (image.double().numpy() for image in images(13, 37))
    as_here = dataclasses.replace(
        protocol, epsilon=0.05, exposure=1.0, ssim_window=5, ssim_sigma=0.7
    )
    lpips = LpipsWithoutWeights()
    given = torch.from_numpy(p), torch.from_numpy(r)
    found = image_metrics(*given, protocol=as_here, lpips=lpips)  # type: ignore[arg-type]
    exposed = [np.clip(2 * radiance, 0, 1) for radiance in (p, r)]
    pictures = [
        np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
        for light in exposed
    ]
    ssim = structural_similarity(
        *pictures,
        data_range=1.0,
        channel_axis=-1,
        gaussian_weights=True,
        sigma=0.7,
        use_sample_covariance=False,
    )
    assert found["mape"] == pytest.approx(np.mean(abs(p - r) / (r + 0.05)), rel=1e-12)
    assert found["mae"] == pytest.approx(np.mean(abs(p - r)), rel=1e-12)
    assert found["dssim"] == pytest.approx((1 - ssim) / 2, abs=1e-9)
    assert found["lpips"] == 0.125
    np.testing.assert_allclose(lpips.given, pictures, atol=1e-12)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_values_that_are_not_finite_are_not_hidden(bad: float) -> None:
    x, y = images(16, 16)
    x[3, 4, 1] = bad
    assert non_finite_pixels(x) == 1
    errors = (mape(x, y, 0.01), mae(x, y), dssim(tone_map(x), tone_map(y)), relmse(x, y, y))
    for value in errors:
        assert not np.isfinite(value)


def test_errors_name_the_shapes() -> None:
    with pytest.raises(ValueError, match=r"\[4, 5, 3\].*\[5, 4, 3\]"):
        mae(torch.zeros(4, 5, 3), torch.zeros(5, 4, 3))
    with pytest.raises(ValueError, match=r"\[5, 4, 3\].*\[4, 5, 3\]"):
        relmse(torch.zeros(5, 4, 3), torch.zeros(5, 4, 3), torch.zeros(4, 5, 3))
    with pytest.raises(ValueError, match="window of 11 pixels"):
        dssim(torch.zeros(10, 20, 3), torch.zeros(10, 20, 3))
