"""Error metrics of one image against its reference (paper, Sec. 7.2.1).

MAPE and MAE compare linear radiance, DSSIM and LPIPS tone-mapped sRGB. Values that are NaN or Inf
are never hidden: they make each of the four metrics, and relMSE, NaN or Inf.
"""

from typing import TypedDict

import torch
import torch.nn.functional as F
from torch import Tensor

from ngi.evaluate.lpips_metric import Lpips
from ngi.evaluate.protocol import EvaluationProtocol


def mape(prediction: Tensor, reference: Tensor, epsilon: float) -> float:
    """Mean of |prediction - reference| / (reference + epsilon), the release's definition.

    prediction, reference: [H, W, 3] linear radiance; epsilon in the same unit.
    """
    _check_shapes(prediction, reference)
    return (_difference(prediction, reference) / (reference.double() + epsilon)).mean().item()


RELMSE_EPSILON = 0.01
"""Of relMSE's denominator, in squared linear radiance; the field's usual one."""

RELMSE_OUTLIERS = 0.001
"""Share of an image's pixels that relMSE leaves out, as is usual: one pixel with a sliver of a lamp
can be more than half of the sum over ten images."""


def relmse(prediction: Tensor, half_a: Tensor, half_b: Tensor) -> float:
    """Relative mean square error that the reference's noise does not add to; below 0 by chance.

    The mean of (p - a)(p - b) / (r² + 0.01) with r = (a + b) / 2 for independent halves a and b of
    the reference's samples: (p - r)² - ((a - b) / 2)², whose second term is the noise of r. The
    other metrics cannot fall below that noise; this one goes on falling. What noise does to the
    denominator remains: where r deviates by σ r from the truth, a prediction that is too bright by
    e r counts e² + 4 e σ², one that is too dark as much less. The pixels with the largest values,
    positive or negative, are left out, one in a thousand.

    prediction, half_a, half_b: [H, W, 3] linear radiance.
    """
    _check_shapes(prediction, half_a)
    _check_shapes(half_a, half_b)
    p, a, b = prediction.double(), half_a.double(), half_b.double()
    reference = 0.5 * (a + b)
    squares = (p - a) * (p - b) / (reference * reference + RELMSE_EPSILON)
    pixels = squares.mean(dim=-1).flatten()
    if not pixels.isfinite().all():
        return pixels.mean().item()
    kept = len(pixels) - int(RELMSE_OUTLIERS * len(pixels))
    return pixels[pixels.abs().argsort()[:kept]].mean().item()


def mae(prediction: Tensor, reference: Tensor) -> float:
    """Mean absolute error of [H, W, 3] linear radiance."""
    _check_shapes(prediction, reference)
    return _difference(prediction, reference).mean().item()


def dssim(prediction: Tensor, reference: Tensor, *, window: int = 11, sigma: float = 1.5) -> float:
    """Structural dissimilarity (1 - SSIM) / 2 of two [H, W, 3] images with values in [0, 1].

    SSIM = (2 μx μy + C1)(2 σxy + C2) / ((μx² + μy² + C1)(σx² + σy² + C2)) of Wang et al. 2004 with
    C1 = 0.01², C2 = 0.03²; the moments are taken under a Gaussian of `sigma` pixels cut to
    `window` x `window` and normalised, without Bessel's correction; the mean goes over the
    channels and over the pixels whose window lies inside the image. Equal to scikit-image's
    structural_similarity(gaussian_weights=True, use_sample_covariance=False) for (11, 1.5).
    """
    _check_shapes(prediction, reference)
    if window % 2 == 0 or min(prediction.shape[:2]) < window:
        raise ValueError(
            f"SSIM window of {window} pixels: it has to be odd and no larger than the image of "
            f"{prediction.shape[1]} x {prediction.shape[0]} pixels"
        )
    offset = torch.arange(window, dtype=torch.float64, device=prediction.device) - window // 2
    kernel = torch.exp(-0.5 * (offset / sigma) ** 2)
    kernel = kernel / kernel.sum()

    def local_mean(image: Tensor) -> Tensor:
        rows = F.conv2d(image, kernel.view(1, 1, -1, 1))
        return F.conv2d(rows, kernel.view(1, 1, 1, -1))

    # Double precision: the variances below are differences of nearly equal numbers.
    x = prediction.double().permute(2, 0, 1).unsqueeze(1)
    y = reference.double().permute(2, 0, 1).unsqueeze(1)
    μx, μy = local_mean(x), local_mean(y)
    σxx, σyy = local_mean(x * x) - μx * μx, local_mean(y * y) - μy * μy
    σxy = local_mean(x * y) - μx * μy
    C1, C2 = 0.01**2, 0.03**2
    ssim = (2 * μx * μy + C1) * (2 * σxy + C2) / ((μx**2 + μy**2 + C1) * (σxx + σyy + C2))
    return 0.5 * (1 - ssim.mean().item())


def tone_map(radiance: Tensor, exposure: float = 0.0) -> Tensor:
    """Linear radiance to sRGB in [0, 1]: times 2^exposure, clipped, sRGB transfer curve.

    radiance: [..., 3] linear RGB with sRGB primaries; exposure in stops. Inf becomes NaN instead
    of white, so that what is computed from the picture does not hide it.
    """
    visible = torch.where(radiance.isfinite(), radiance * 2.0**exposure, torch.nan)
    linear = visible.clamp(0, 1)
    curve = 1.055 * linear.clamp(min=0.0031308) ** (1 / 2.4) - 0.055
    return torch.where(linear <= 0.0031308, 12.92 * linear, curve)


def radiance_of(log_radiance: Tensor) -> Tensor:
    """Linear radiance of what a network says, log1p radiance; negative values stay as they are.

    NaN where that is not finite: of -Inf it would be a number, -1.
    """
    return torch.expm1(torch.where(log_radiance.isfinite(), log_radiance, torch.nan))


def non_finite_pixels(image: Tensor) -> int:
    """Number of pixels of an [H, W, 3] image with a NaN or Inf in any channel."""
    return int((~image.isfinite()).any(dim=-1).sum())


def _difference(prediction: Tensor, reference: Tensor) -> Tensor:
    return (prediction.double() - reference.double()).abs()


def _check_shapes(prediction: Tensor, reference: Tensor) -> None:
    if prediction.shape != reference.shape or prediction.ndim != 3 or prediction.shape[2] != 3:
        raise ValueError(
            f"prediction {list(prediction.shape)} and reference {list(reference.shape)}: "
            "both have to be [H, W, 3] of the same size"
        )


class ImageMetrics(TypedDict):
    """MAPE, DSSIM, MAE and LPIPS, which is None where it is not available."""

    mape: float
    dssim: float
    mae: float
    lpips: float | None


def image_metrics(
    prediction: Tensor, reference: Tensor, *, protocol: EvaluationProtocol, lpips: Lpips | None
) -> ImageMetrics:
    """prediction, reference: [H, W, 3] linear radiance, at least SSIM's window a side.

    lpips: None where its time is not worth it; it takes at least `SMALLEST_RESOLUTION` a side
    """
    picture = tone_map(prediction, protocol.exposure)
    wanted = tone_map(reference, protocol.exposure)
    return ImageMetrics(
        mape=mape(prediction, reference, protocol.epsilon),
        dssim=dssim(picture, wanted, window=protocol.ssim_window, sigma=protocol.ssim_sigma),
        mae=mae(prediction, reference),
        lpips=lpips(picture, wanted) if lpips is not None and lpips.available else None,
    )
