"""What the chains did at a generated batch: a record of `chains.bin`, columns of steps.csv."""

from __future__ import annotations

import numpy as np
from torch import Tensor

from ngi.explore import ChainInfo, Proposals
from ngi.files.record_log import MOST_VARIABLES


def chain_record(
    proposals: Proposals,
    info: ChainInfo,
    *,
    target_proposed: Tensor | None,
    target_current: Tensor | None,
) -> dict[str, np.ndarray]:
    """One step of n chains, as `ngi.files.record_log.CHAINS` says.

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


def chain_row(info: ChainInfo | None) -> dict[str, float | None]:
    """Of the same, what is logged with the step; None where no batch was generated."""
    return {
        "acceptance_rate": None if info is None else info.acceptance_rate,
        "large_step_acceptance_rate": None if info is None else info.large_step_acceptance_rate,
        "small_step_acceptance_rate": None if info is None else info.small_step_acceptance_rate,
        "chain_mean_age": None if info is None else info.mean_age,
    }
