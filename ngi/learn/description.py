"""What is known of a patch before its paths are traced, and what the network was wrong about after.

Where patches are dear, losses are predicted from the first by the second
(`ngi.explore.PredictedFromBuffers`).
"""

from collections.abc import Callable

import torch
from torch import Tensor

from ngi.explore import Describe
from ngi.learn.glimpses import sparse
from ngi.learn.samples import Samples
from ngi.models.loss import log_of_radiance
from ngi.patches import Patches

DARK = 0.1
"""Radiance below which an error counts by its size, and above which by its share of the radiance.

What is bright has the larger errors, but pictures are compared by relative ones: chosen by absolute
errors, patches leave out dark images.
"""

Answers = Callable[..., tuple[Tensor, Tensor]]
"""See `IlluminationModule.answers`."""


class Description:
    """Describes states by `features`, among which the disagreement is in units of its mean.

    A network's weights move less and less: how far present and averaged ones are apart says in
    which patches there is more to learn than in others, and nothing by its size.
    """

    def __init__(self, *, samples: Samples, answers: Answers) -> None:
        self._samples = samples
        self._answers = answers

    def at(self, resolution: int) -> Describe:
        """Of states [n, D + 2] the features [n, F], in an image of so many pixels a side."""
        return lambda states: self._features(states, resolution)

    def _features(self, states: Tensor, resolution: int) -> Tensor:
        buffers, vectors = self._samples.glimpses(states, resolution=resolution)
        return disagreeing_relatively(
            features(buffers, vectors, *self._answers(buffers, vectors)).cpu()
        )

    def errors(self, patches: Patches) -> Tensor:
        """[n] `distances` of the averaged network's answers to traced radiance, in a glimpse."""
        (buffers, vectors), log_radiance = self._samples.example(patches)
        _, averaged = self._answers(sparse(buffers).contiguous(), vectors)
        return distances(averaged, sparse(log_radiance).float().cpu())


def distances(one: Tensor, other: Tensor) -> Tensor:
    """[n] mean absolute differences of log(radiance + `DARK`).

    one, other: images [n, h, w, 3] of log1p radiance, at least 0 or counted as 0
    """
    one, other = (log_of_radiance(image.float(), offset=DARK) for image in (one, other))
    return (one - other).abs().mean(dim=(1, 2, 3))


def features(buffers: Tensor, vectors: Tensor, present: Tensor, averaged: Tensor) -> Tensor:
    """[n, 2 C + 6 + D + 1], the last the disagreement: how far the two answers are apart.

    Before it, mean and deviation of each buffer and of log(radiance + `DARK`) by the averaged
    weights, and v.

    buffers: [n, h, w, C]; vectors: [n, D]; present, averaged: answers [n, h, w, 3], log1p radiance
    """
    logarithms = log_of_radiance(averaged.float(), offset=DARK).to(buffers.device)
    pixels = torch.cat([buffers.float(), logarithms], dim=-1)
    disagreement = distances(present, averaged)
    return torch.cat(
        [
            pixels.mean((1, 2)),
            pixels.std((1, 2)),
            vectors.to(pixels),
            disagreement[:, None].to(pixels),
        ],
        dim=1,
    )


def disagreeing_relatively(known: Tensor) -> Tensor:
    """`features` [n, F] whose disagreement is in units of its mean, 1 where all agree."""
    disagreement = known[:, -1:].contiguous()  # summed as if it stood alone
    mean = disagreement.mean()
    relative = disagreement / mean if mean > 0 else torch.ones_like(disagreement)
    return torch.cat([known[:, :-1], relative], dim=1)
