"""Which configurations of the scene are looked at."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor
from torch.quasirandom import SobolEngine

from ngi.evaluate.protocol import EvaluationProtocol
from ngi.render.protocol import Renderer


@dataclass(frozen=True)
class Frame:
    """One test image.

    set: "hard" or "uniform"
    index: its number within the set, from 0
    scene_vector: [D] float32, v in [0, 1]^D
    """

    set: str
    index: int
    scene_vector: Tensor


def evaluation_frames(renderer: Renderer, protocol: EvaluationProtocol) -> tuple[Frame, ...]:
    """The scene's hard frames (paper, Sec. 7.2.1), then the low-discrepancy set.

    The latter are the first points of a scrambled Sobol sequence over [0, 1]^D: they stand for the
    mean over all configurations, which the hard frames of a path do not.
    Raises ValueError for hard frames whose length is not the scene's D.
    """
    hard = renderer.hard_frames()
    if hard.ndim != 2 or hard.shape[1] != renderer.dimensions:
        raise ValueError(
            f"hard frames of shape {list(hard.shape)}: the scene has {renderer.dimensions} "
            f"variables, so [n, {renderer.dimensions}] is expected"
        )
    engine = SobolEngine(renderer.dimensions, scramble=True, seed=protocol.sobol_seed)
    uniform = engine.draw(protocol.low_discrepancy_frames)
    return tuple(
        Frame(set=name, index=index, scene_vector=v.detach().cpu().float())
        for name, vectors in (("hard", hard), ("uniform", uniform))
        for index, v in enumerate(vectors)
    )
