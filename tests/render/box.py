"""Of the scene `load_box`: its folder, a configuration, and states of patches."""

from pathlib import Path

import torch

BOX = Path(__file__).parent / "scenes" / "box"

V = torch.tensor([0.2, 0.9, 0.4, 0.8, 0.4, 0.3, 0.3, 0.6, 0.25, 0.6])


def states(n, seed=0):
    return torch.rand(n, 12, generator=torch.Generator().manual_seed(seed))
