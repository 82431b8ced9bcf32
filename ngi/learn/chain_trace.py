"""What the chains did at a generated batch, as a record of `chains.bin`."""

from __future__ import annotations

import numpy as np
from torch import Tensor

from ngi.explore import ChainInfo, Proposals
from ngi.files.records import MOST_VARIABLES


def chain_record(
    proposals: Proposals,
    info: ChainInfo,
    *,
    target_proposed: Tensor | None,
    target_current: Tensor | None,
) -> dict[str, np.ndarray]:
    """One step of n chains, as `ngi.files.records.CHAINS` says.

    `RunFolder.chains` keeps it, with the step.

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
