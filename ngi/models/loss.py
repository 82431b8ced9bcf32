"""The training loss: L1 and structural dissimilarity of radiance, one value per sample."""

from dataclasses import dataclass
from typing import Protocol

import torch
import torch.nn.functional as F
from torch import Tensor


class SampleLoss(Protocol):
    """A loss that keeps the samples of a batch apart."""

    def __call__(self, prediction: Tensor, target: Tensor) -> Tensor:
        """Log1p radiance [n, P, P, 3], predicted and rendered, to the loss of each sample, [n]."""
        ...


LEAST_OFFSET = 1e-5
"""Of `log_of_radiance`: 1 − offset is rounded by 6e-8."""


def log_of_radiance(log1p_radiance: Tensor, *, offset: float) -> Tensor:
    """log(r + offset) of log1p radiance, also where r would overflow; of negative r that of 0."""
    above = log1p_radiance.clamp_min(0)
    return above + ((offset - 1) * (-above).exp()).log1p()


@dataclass(frozen=True, kw_only=True)
class L1Dssim:
    """l1_weight · mean |prediction − target| + dssim_weight · (1 − SSIM) / 2 (paper, Sec. 6).

    Ours adds relative_weight · mean |log(r + relative_offset) − log(r' + relative_offset)|, with r
    and r' the radiance that is predicted and wanted. In log1p radiance an error of half the
    light counts next to nothing where there is little of it; here it counts alike everywhere.

    SSIM is that of Wang et al. 2004: Gaussian window, weighted (not sample) covariances, each
    channel by itself, averaged over the windows that lie in the patch. It is computed in float32
    (float64 for float64 input), under autocast too. Of 32x32 pixels 22x22 are the middle of such a
    window, of 16x16 6x6; where `mirrored` all are.

    l1_weight, dssim_weight: the release has 2·L1 + (1 − SSIM), which is 2 and 2 here
    window_size: pixels along the window's side, odd
    sigma: the Gaussian's standard deviation, in pixels
    k1, k2: stabilise the ratio where means or variances vanish
    data_range: L, the range of the values, in log1p radiance; the release takes 1
    relative_weight: 0 in the paper
    relative_offset: in radiance; what is far below it counts by its absolute error again
    mirrored: continue the patch by its mirror image, so that every pixel is a window's middle
    release_layout: read the patch as the release does, which takes its [n, P, P, 3] for channels
        first: the window then spans columns and colours of one row of pixels, zeros around them.
        It makes the term 4 to 5 times weaker
    """

    l1_weight: float
    dssim_weight: float
    window_size: int = 11
    sigma: float = 1.5
    k1: float = 0.01
    k2: float = 0.03
    data_range: float = 1.0
    relative_weight: float = 0.0
    relative_offset: float = 0.03
    mirrored: bool = False
    release_layout: bool = False

    def __post_init__(self) -> None:
        for name in ("l1_weight", "dssim_weight", "relative_weight"):
            if getattr(self, name) < 0:
                raise ValueError(f"loss.{name} is {getattr(self, name)}: it cannot be negative")
        if self.l1_weight == self.dssim_weight == self.relative_weight == 0:
            raise ValueError("all weights of the loss are 0; raise loss.l1_weight")
        if self.window_size < 1 or self.window_size % 2 == 0:
            raise ValueError(f"loss.window_size is {self.window_size}: it must be odd and positive")
        if self.mirrored and self.release_layout:
            raise ValueError(
                "loss.mirrored and loss.release_layout are both true, but the release pads patches "
                "with zeros; set one of them to false"
            )
        for name in ("sigma", "k1", "k2", "data_range"):
            if getattr(self, name) <= 0:
                raise ValueError(f"loss.{name} is {getattr(self, name)}: it must be above 0")
        if self.relative_offset < LEAST_OFFSET:
            raise ValueError(
                f"loss.relative_offset is {self.relative_offset}: it must be {LEAST_OFFSET} or "
                "more: single precision cannot resolve smaller numbers"
            )

    def __call__(self, prediction: Tensor, target: Tensor) -> Tensor:
        """Log1p radiance [n, P, P, 3], predicted and rendered, to the loss of each sample, [n].

        Raises ValueError for shapes that differ and for patches smaller than the window.
        """
        if prediction.shape != target.shape or prediction.ndim != 4:
            raise ValueError(
                f"prediction {list(prediction.shape)} and target {list(target.shape)}: expected "
                "the same shape [n, P, P, 3]"
            )
        with torch.autocast(prediction.device.type, enabled=False):
            if prediction.dtype != torch.float64:
                prediction, target = prediction.float(), target.float()
            l1 = (prediction - target).abs().mean(dim=(1, 2, 3))
            dssim = (1 - self._ssim(self._planes(prediction), self._planes(target))) / 2
            # Rounding can take SSIM above 1 by 1e-7, and samples are drawn in proportion to this.
            loss = self.l1_weight * l1 + self.dssim_weight * dssim.clamp_min(0)
            if self.relative_weight:
                offset = self.relative_offset
                wanted = log_of_radiance(target, offset=offset)
                difference = log_of_radiance(prediction, offset=offset) - wanted
                loss = loss + self.relative_weight * difference.abs().mean(dim=(1, 2, 3))
            return loss

    def _planes(self, image: Tensor) -> Tensor:
        """[n, planes, height, width]: the images the window slides over."""
        if self.release_layout:
            return F.pad(image, [self.window_size // 2] * 4)
        if min(image.shape[1:3]) < self.window_size:
            raise ValueError(
                f"patches of {image.shape[2]} x {image.shape[1]} pixels are smaller than the "
                f"SSIM window: lower loss.window_size (it is {self.window_size}) or raise "
                "renderer.patch_size"
            )
        return image.movedim(-1, 1)

    def _ssim(self, x: Tensor, y: Tensor) -> Tensor:
        """Mean structural similarity of each sample, [n], from [n, planes, height, width]."""
        c1, c2 = (self.k1 * self.data_range) ** 2, (self.k2 * self.data_range) ** 2
        # Offsets change no variance and no covariance, but E[x²] − E[x]² loses digits with them.
        offset_x, offset_y = (z.detach().mean(dim=(2, 3), keepdim=True) for z in (x, y))
        x, y = x - offset_x, y - offset_y
        mean_x, mean_y, xx, yy, xy = self._filter(torch.stack([x, y, x * x, y * y, x * y]))
        variances = (xx - mean_x * mean_x) + (yy - mean_y * mean_y)
        covariance = xy - mean_x * mean_y
        mean_x, mean_y = mean_x + offset_x, mean_y + offset_y
        luminance = (2 * mean_x * mean_y + c1) / (mean_x * mean_x + mean_y * mean_y + c1)
        structure = (2 * covariance + c2) / (variances + c2)
        similarity: Tensor = (luminance * structure).mean(dim=(1, 2, 3))
        return similarity

    def _filter(self, images: Tensor) -> Tensor:
        """Weighted means over every window of the last two dimensions.

        The window is separable: two products with banded matrices, which for patches of this
        size take less time than convolutions.
        """
        height, width = images.shape[-2:]
        rows = self._band_matrix(height, images)
        columns = rows if width == height else self._band_matrix(width, images)
        return rows @ images @ columns.T

    def _band_matrix(self, size: int, like: Tensor) -> Tensor:
        """[size − window_size + 1, size]: row i holds the normalised window that starts at i.

        [size, size] where the image is continued by its mirror image: row i has its middle at i.
        """
        radius = self.window_size // 2
        outside = radius if self.mirrored else 0
        pixels = torch.arange(-outside, size + outside, device=like.device, dtype=like.dtype)
        centre = pixels[radius : len(pixels) - radius]
        distance = pixels - centre[:, None]
        weight = torch.exp(-0.5 * (distance / self.sigma) ** 2) * (distance.abs() <= radius)
        before, inside, after = weight.split([outside, size, outside], dim=1)
        inside[:, :outside] += before.flip(1)
        inside[:, size - outside :] += after.flip(1)
        normalised: Tensor = inside / inside.sum(dim=1, keepdim=True)
        return normalised
