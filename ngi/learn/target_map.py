"""The target density over the variables of a scene that has two of them (paper, Fig. 6)."""

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor
from torch.quasirandom import SobolEngine
from tqdm import tqdm

from ngi.explore import Proposals, Signals, Target
from ngi.learn.ahead import ProposalsAhead
from ngi.learn.samples import Samples
from ngi.patches import Patches
from ngi.reuse import CompactPatches

PATCHES_AT_ONCE = 16
"""Rendered and scored together: as many as in a batch of training."""

SignalsOf = Callable[[Patches, Target], Signals]
"""What the network, as it is now, says about [n] patches, as far as the target requires it."""


class TargetMap:
    """Evaluates the target density of fixed patches over a grid of v in [0, 1]^2.

    In every cell v and the patch position come from a Sobol sequence with a scrambling of its own,
    so that the mean over a cell's patches is the density of v there. All runs of a scene have the
    same patches. They are rendered once, by `prepare`.

    cells: g, along each variable
    positions_per_cell: k, patches per cell
    target: the density; need not be the sampler's, so that the maps of samplers can be compared
    resolution: pixels along a side of the virtual image that the patches are cut from
    signals: asks the network, without changing anything of it
    Raises ValueError for a scene without exactly two variables and for counts below 1.
    """

    def __init__(
        self,
        *,
        cells: int,
        positions_per_cell: int,
        target: Target,
        resolution: int,
        samples: Samples,
        signals: SignalsOf,
    ) -> None:
        if samples.dimensions != 2:
            raise ValueError(
                f"evaluation.target_map: the scene has {samples.dimensions} variables, a map "
                "needs 2; choose scene=mirror, or evaluation.target_map=null"
            )
        for name, count in (("cells", cells), ("positions_per_cell", positions_per_cell)):
            if count < 1:
                raise ValueError(f"evaluation.target_map.{name}: {count}; expected at least 1")
        self._states = map_states(cells, positions_per_cell)
        self.target = target
        self._resolution = resolution
        self._samples = samples
        self._signals = signals
        self._patches: list[CompactPatches] = []

    def prepare(self) -> None:
        """Renders the patches, with a progress bar; nothing happens the second time."""
        if self._patches:
            return
        states = self._states.flatten(0, 2)
        with tqdm(total=len(states), desc="target map", unit="patch") as progress:
            for seed, chunk in enumerate(states.split(PATCHES_AT_ONCE)):
                self._patches.append(self._render(chunk, seed=seed))
                progress.update(len(chunk))

    def measure(self) -> dict[str, np.ndarray]:
        """`state`, and `loss` and `target` under the present weights.

        See `ngi.files.record_log.TARGET_MAPS`.
        """
        self.prepare()
        signals = [self._signals(patches.expand(), self.target) for patches in self._patches]
        return {
            "state": self._states.numpy(),
            "loss": self._grid([part.loss for part in signals]),
            "target": self._grid([self.target(part) for part in signals]),
        }

    def _render(self, states: Tensor, *, seed: int) -> CompactPatches:
        proposals = Proposals(states, large_step=torch.ones(len(states), dtype=torch.bool))
        ahead = ProposalsAhead(proposals, resolution=self._resolution, seed=seed)
        ahead.start(self._samples)
        return CompactPatches.compress(ahead.patches(), self._samples.layout)

    def _grid(self, parts: list[Tensor]) -> np.ndarray:
        return torch.cat(parts).float().numpy(force=True).reshape(self._states.shape[:-1])


def map_states(cells: int, positions_per_cell: int) -> Tensor:
    """[g, g, k, 4] float32: v in its cell of [0, 1]^2, then the patch position in [0, 1)^2."""
    points = [
        SobolEngine(4, scramble=True, seed=cell).draw(positions_per_cell)
        for cell in range(cells**2)
    ]
    states: Tensor = torch.stack(points).unflatten(0, (cells, cells))
    index = torch.arange(cells)
    corners = torch.stack(torch.meshgrid(index, index, indexing="ij"), dim=-1)
    states[..., :2] = (states[..., :2] + corners[:, :, None]) / cells
    return states
