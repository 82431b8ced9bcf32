"""Downloads AlexNet's weights for LPIPS: `python -m ngi.evaluate.lpips_download`.

Part of `make setup`, which goes on without them where they cannot be had.
"""

import os
import socket
import sys
from http.client import HTTPException
from pathlib import Path

import torch

from ngi.evaluate.lpips_metric import cached_weights
from ngi.machine.torchvision_operators import ensure_torchvision_operators

SHA256 = "7be5be791159472b1fbf3c69796f7cb30dca7ad8466c2df70058c37116cdee02"
SIZE = "244 MB"
PATIENCE = 20.0
"""Seconds without an answer after which there is no network."""


def download(url: str, to: Path, *, sha256: str) -> None:
    """Writes the file, whole or not at all.

    Raises OSError or HTTPException where it does not come or cannot be written, RuntimeError where
    its checksum is another one.
    """
    to.parent.mkdir(parents=True, exist_ok=True)
    usual = socket.getdefaulttimeout()
    socket.setdefaulttimeout(PATIENCE)
    try:
        torch.hub.download_url_to_file(url, str(to), sha256, progress=sys.stderr.isatty())
    finally:
        socket.setdefaulttimeout(usual)


def main() -> int:
    """Says in a line what came of it; 1 where there are no weights now."""
    if configured := os.environ.get("NGI_LPIPS_WEIGHTS"):
        if not Path(configured).is_file():
            print(f"LPIPS: NGI_LPIPS_WEIGHTS={configured}: no such file; correct or unset it")
            return 1
        print(f"LPIPS: AlexNet's weights are those of NGI_LPIPS_WEIGHTS={configured}")
        return 0
    place = cached_weights()
    if place.exists():
        print(f"LPIPS: AlexNet's weights are in {place}")
        return 0
    print(f"LPIPS: downloading AlexNet's weights ({SIZE}) to {place}", flush=True)
    try:
        download(_url(), place, sha256=SHA256)
    except (OSError, HTTPException, RuntimeError) as error:
        print(f"LPIPS: no weights, so its column stays empty ({error})")
        return 1
    return 0


def _url() -> str:
    """Where torchvision says that they are."""
    ensure_torchvision_operators()
    from torchvision.models import AlexNet_Weights

    url: str = AlexNet_Weights.IMAGENET1K_V1.url
    return url


if __name__ == "__main__":
    sys.exit(main())
