"""Of the scene `load_box`: its folder, a configuration, states of patches; what is traced."""

from pathlib import Path

import torch

BOX = Path(__file__).parent / "scenes" / "box"

V = torch.tensor([0.2, 0.9, 0.4, 0.8, 0.4, 0.3, 0.3, 0.6, 0.25, 0.6])


def states(n, seed=0):
    return torch.rand(n, 12, generator=torch.Generator().manual_seed(seed))


def windows_of_buffers(renderer, monkeypatch):
    """A list to which every window is added whose buffers the renderer traces from here on."""
    windows = []
    buffers = renderer._tracer.buffers
    monkeypatch.setattr(
        renderer._tracer,
        "buffers",
        lambda window, samples: (windows.append(window), buffers(window, samples=samples))[1],
    )
    return windows
