"""What is known of a patch before its paths are traced: buffers, v, and what the network makes of
both. Predictions of losses are made from it where patches are dear (`ngi.explore.PredictedLoss`).
"""

from collections.abc import Callable

import torch
from torch import Tensor

from ngi.learn.samples import Samples

Disagreement = Callable[..., Tensor]
"""[n] of the network's inputs, see `IlluminationModule.disagreement`."""


class Description:
    """Describes states by `features`, among which the disagreement is in units of its mean.

    A network's weights move less and less: how far present and averaged ones are apart says in
    which patches there is more to learn than in others, and nothing by its size.
    """

    def __init__(self, *, samples: Samples, disagreement: Disagreement) -> None:
        self._samples = samples
        self._disagreement = disagreement

    def __call__(self, states: Tensor, resolution: int) -> Tensor:
        """[n, F] of states [n, D + 2], of patches of an image with so many pixels a side."""
        buffers, vectors = self._samples.glimpses(states, resolution=resolution)
        found = self._disagreement(buffers, vectors).float().cpu()
        mean = found.mean()
        relative = found / mean if mean > 0 else torch.ones_like(found)
        return features(buffers, vectors, relative).cpu()


def features(buffers: Tensor, vectors: Tensor, disagreement: Tensor) -> Tensor:
    """[n, 2 C + D + 1]: mean and deviation of buffers [n, h, w, C], v [n, D], disagreement [n]."""
    pixels = buffers.float()
    return torch.cat(
        [
            pixels.mean((1, 2)),
            pixels.std((1, 2)),
            vectors.to(pixels),
            disagreement[:, None].to(pixels),
        ],
        dim=1,
    )
