"""Proposals whose patches are rendered while the network trains on stored ones.

The chains stand still while patches are reused, so that where they propose to go next is known as
soon as they have accepted or rejected the last proposals. Rendered early or late, in this process
or by others, these give the same patches: what changes is how long training waits for them.
"""

from dataclasses import dataclass, fields
from typing import Any, Self

import torch

from ngi.explore import Proposals
from ngi.learn.reading import read
from ngi.learn.samples import Samples
from ngi.patches import Patches
from ngi.render.protocol import PatchJob, RenderedPatches


@dataclass
class ProposalsAhead:
    """The next proposals of n chains, on their way to being patches.

    resolution: pixels along a side of the virtual image that the patches are cut from
    seed: of their rendering
    job: their rendering, None until `start`
    """

    proposals: Proposals
    resolution: int
    seed: int
    job: PatchJob | None = None

    def start(self, samples: Samples) -> None:
        """Has the patches rendered; nothing happens the second time."""
        if self.job is None:
            self.job = samples.start_patches(
                self.proposals.position, resolution=self.resolution, seed=self.seed
            )

    @property
    def late(self) -> bool:
        """Whether others are still rendering them."""
        return self.job is not None and not self.job.done()

    def result(self) -> RenderedPatches:
        """What was rendered, waited for. Raises RuntimeError before `start`."""
        if self.job is None:
            raise RuntimeError("these patches are not being rendered yet; call start() first")
        return self.job.result()

    def patches(self) -> Patches:
        """[n] the proposals with what was rendered, waited for; raises as `result` does."""
        rendered = self.result()
        position = self.proposals.position
        return Patches(
            scene_vector=position[:, :-2],
            position=position[:, -2:],
            resolution=torch.full((len(position),), self.resolution),
            large_step=self.proposals.large_step,
            buffers=rendered.buffers,
            log_radiance=rendered.log_radiance,
        )

    def unusable(self) -> str | None:
        """Which of the patches hold NaN or Inf, and how to render them again; None for none."""
        rendered = self.result()
        finite = read(_finite(rendered.buffers), _finite(rendered.log_radiance))
        broken = torch.stack(finite).amin(dim=0) == 0
        if not broken.any():
            return None
        return (
            f"NaN or Inf in the patches of the states {self.proposals.position[broken].tolist()} "
            f"(v, then patch position), resolution {self.resolution}, seed {self.seed}"
        )

    def state_dict(self) -> dict[str, Any]:
        """What has to be rendered, not what has been: that is rendered again."""
        return {**vars(self.proposals), "resolution": self.resolution, "seed": self.seed}

    @classmethod
    def from_state_dict(cls, state: dict[str, Any]) -> Self:
        """The same proposals, not started."""
        return cls(
            Proposals(**{field.name: state[field.name] for field in fields(Proposals)}),
            resolution=state["resolution"],
            seed=state["seed"],
        )


def _finite(patches: torch.Tensor) -> torch.Tensor:
    """[n] 1 or 0, of patches [n, …]."""
    return patches.isfinite().flatten(1).all(dim=1).float()
