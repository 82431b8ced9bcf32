"""Light that no network has to learn, because the buffers tell it."""

import torch
from torch import Tensor

from ngi.patches import BufferLayout

EMITTER_THRESHOLD = 1.0
"""log1p of emitted radiance above which a pixel shows the emitter and nothing else."""


def add_known_light(output: Tensor, buffers: Tensor, layout: BufferLayout) -> Tensor:
    """A network's output, [..., 3] in log1p space, with emission and direct light added to it.

    Emission is passed through as in the release: where(emission > 1, emission, output + emission).
    Where the buffers hold direct light, output + log1p(expm1(emission) + expm1(direct)) stands in
    place of output + emission, so that the network has to learn the indirect light only.

    buffers: [..., C], channels as the layout says
    """
    known = {
        name: buffers[..., layout.slice(name)]
        for name in ("direct", "emission")
        if name in layout.names
    }
    if len(known) == 2:  # they add up as radiance, not as its logarithm
        output = output + torch.log1p(known["direct"].expm1() + known["emission"].expm1())
    elif known:
        output = output + next(iter(known.values()))
    if "emission" not in known:
        return output
    return torch.where(known["emission"] > EMITTER_THRESHOLD, known["emission"], output)
