"""What the chains did at a generated batch, as a record of `chains.bin`."""

from __future__ import annotations

import numpy as np
from torch import Tensor

from ngi.explore import ChainInfo, Proposals

MOST_VARIABLES = 62
"""Positions are left out in scenes of more variables: their files would grow to gigabytes."""

DESCRIPTION = (
    "One record per generated batch of n chains; step as in steps.csv. "
    "position [n, S]: the proposals, scene variables and then patch position, in [0, 1] "
    f"(left out in scenes of more than {MOST_VARIABLES} variables). "
    "large_step, accepted [n]: a chain that accepted stands at its proposal, any other where it "
    "stood. initialised [n]: the chain held no state before. "
    "target_proposed, target_current [n]: target density of the proposal and of the state before, "
    "under the weights of that step; NaN where it was not computed."
)


def chain_record(
    proposals: Proposals,
    info: ChainInfo,
    *,
    target_proposed: Tensor | None,
    target_current: Tensor | None,
) -> dict[str, np.ndarray]:
    """One step of n chains, as `DESCRIPTION` says; `RunFolder.chains` keeps it, with the step.

    target_proposed, target_current: [n], of any device; None where nothing was scored
    """
    position = proposals.position.numpy(force=True)
    record = {} if position.shape[1] - 2 > MOST_VARIABLES else {"position": position}
    for name in ("large_step", "accepted", "initialised"):
        record[name] = getattr(info, name).numpy(force=True)
    unknown = np.full(len(position), np.nan, dtype=np.float32)
    for name, target in (("target_proposed", target_proposed), ("target_current", target_current)):
        record[name] = unknown if target is None else target.float().numpy(force=True)
    return record
