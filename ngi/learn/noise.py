"""How much of a patch's loss is noise of the patch, which no network can learn.

It is known of patches that are traced in two halves (`renderer.halves`).
"""

import torch
import torch.nn.functional as F
from torch import Tensor

from ngi.learn.batch import Batch
from ngi.models import SampleLoss

BLURRED = 5
"""Pixels along the side of the square that stands in for the truth about its middle."""


@torch.no_grad()
def noise_loss(loss: SampleLoss, batch: Batch) -> Tensor:
    """What a network that knew the truth would lose on each patch of a batch, [n].

    The patch m is the mean of two halves of its samples, a and b. Half of their difference,
    a - m = (a - b) / 2, has the variance of the noise of m and does not depend on it, so that for a
    squared error p - a and p - b multiply to (p - m)² - ((a - b) / 2)², whatever the network's
    answer p is: the noise's share is one number per patch. L1 and DSSIM have no such formula.
    They are asked for the loss between a blurred m, which has little noise, and the same with the
    noise a - m. Where the patch has details that blurring takes away this is a little too large.

    batch: with `first_half`, a of [n, P, P, 3]
    """
    assert batch.first_half is not None
    mean = batch.patches.log_radiance
    size = min(BLURRED, mean.shape[1] | 1)
    padded = F.pad(mean.movedim(-1, 1), [size // 2] * 4, mode="replicate")
    blurred = F.avg_pool2d(padded, size, stride=1).movedim(1, -1)
    return loss(blurred, blurred + (batch.first_half - mean))


def without_noise(losses: Tensor, noise: Tensor) -> Tensor:
    """Losses [n] as they would be without noise, from `noise_loss` [n]; at least 0.

    Squares are subtracted: a mean absolute error d under noise of the standard deviation s is near
    the root of d² + (2/π) s², which is exact both where nothing is left to learn and where the
    error is far larger than the noise.
    """
    return (losses.square() - noise.square()).clamp_min(0).sqrt()
