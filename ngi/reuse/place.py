"""Where stored patches are kept."""

import logging

import torch

SHARE = 0.5
"""Of the GPU's free memory, that patches may take at most; the rest is for rendering and steps."""

log = logging.getLogger(__name__)


def place_for(nbytes: float, device: torch.device) -> torch.device:
    """The device that trains where so many bytes fit into `SHARE` of its memory, else the CPU."""
    if device.type != "cuda":
        return device
    free, _ = torch.cuda.mem_get_info(device)
    place = device if nbytes <= SHARE * free else torch.device("cpu")
    log.info(
        "the store's patches, up to %.1f GB, are kept on the %s; the GPU has %.1f GB free",
        nbytes / 1e9,
        "GPU" if place.type == "cuda" else "CPU",
        free / 1e9,
    )
    return place
