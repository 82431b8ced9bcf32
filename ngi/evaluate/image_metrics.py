"""The four metrics of one image, as a protocol has them."""

from __future__ import annotations

from typing import TypedDict

from torch import Tensor

from ngi.evaluate.lpips_metric import Lpips
from ngi.evaluate.metrics import dssim, mae, mape, tone_map
from ngi.evaluate.protocol import EvaluationProtocol


class ImageMetrics(TypedDict):
    """MAPE, DSSIM, MAE and LPIPS, which is None where it is not available."""

    mape: float
    dssim: float
    mae: float
    lpips: float | None


def image_metrics(
    prediction: Tensor, reference: Tensor, *, protocol: EvaluationProtocol, lpips: Lpips | None
) -> ImageMetrics:
    """prediction, reference: [H, W, 3] linear radiance, at least as large as SSIM's window.

    lpips: None where its time is not worth it
    """
    picture = tone_map(prediction, protocol.exposure)
    wanted = tone_map(reference, protocol.exposure)
    return ImageMetrics(
        mape=mape(prediction, reference, protocol.epsilon),
        dssim=dssim(picture, wanted, window=protocol.ssim_window, sigma=protocol.ssim_sigma),
        mae=mae(prediction, reference),
        lpips=lpips(picture, wanted) if lpips is not None and lpips.available else None,
    )
