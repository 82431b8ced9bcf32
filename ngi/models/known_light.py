"""Light that no network has to learn, because the buffers tell it."""

import torch
from torch import Tensor

from ngi.patches import BufferLayout

EMITTER_THRESHOLD = 1.0
"""log1p of emitted radiance above which, as in the release, a pixel shows the emitter alone."""


def add_known_light(
    output: Tensor, buffers: Tensor, layout: BufferLayout, *, linear_emission: bool = False
) -> Tensor:
    """A network's output, [..., 3] in log1p space, with emission and direct light added to it.

    Emission is passed through as in the release: where(emission > 1, emission, output + emission).
    Where the buffers hold direct light, output + log1p(expm1(emission) + expm1(direct)) stands in
    place of output + emission, so that the network has to learn the indirect light only.

    buffers: [..., C], channels as the layout says
    linear_emission: emission is added as radiance to what the network makes of the rest, however
        bright it is: log1p(expm1(emission) + expm1(output + direct)). A pixel that an emitter fills
        in part shows the rest of it, too, and no error of the network scales the emitter.
    """
    known = {
        name: buffers[..., layout.slice(name)]
        for name in ("direct", "emission")
        if name in layout.names
    }
    if linear_emission and "emission" in known:
        rest = output + known["direct"] if "direct" in known else output
        return torch.logaddexp(_logarithm(known["emission"].contiguous().expm1()), rest)
    if len(known) == 2:  # they add up as radiance, not as its logarithm
        output = output + torch.log1p(known["direct"].expm1() + known["emission"].expm1())
    elif known:
        output = output + next(iter(known.values()))
    if "emission" not in known:
        return output
    return torch.where(known["emission"] > EMITTER_THRESHOLD, known["emission"], output)


def _logarithm(radiance: Tensor) -> Tensor:
    """Minus infinity where nothing emits, of which a processor takes four times as long to tell."""
    dark = radiance == 0
    return radiance.masked_fill(dark, 1).log().masked_fill(dark, -torch.inf)
