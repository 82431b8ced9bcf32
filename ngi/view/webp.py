"""Animated WebP pictures, which pages and READMEs show where they show no video."""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ngi.files.durable import write_atomically
from ngi.view.mp4 import AddFrame

QUALITY = 90
"""Of 100: nothing is to be seen of what is lost, in 10 to 19 KB a frame of 256 x 256 pixels."""


@contextmanager
def webp_file(path: Path, *, frames_per_second: int) -> Iterator[AddFrame]:
    """Gives a function that adds a picture, [H, W, 3] uint8 sRGB, all of one size, at least one.

    It begins again after the last. The file gets its name when it is whole, and none where anything
    is raised.
    """
    frames: list[Image.Image] = []

    def add(picture: NDArray[np.uint8]) -> None:
        frames.append(Image.fromarray(picture))

    yield add
    content = BytesIO()
    frames[0].save(
        content,
        "WEBP",
        save_all=True,
        append_images=frames[1:],
        duration=round(1000 / frames_per_second),
        loop=0,
        quality=QUALITY,
        kmin=0,
        kmax=1,  # each frame by itself: what differences leave behind shows on walls
    )
    write_atomically(path, content.getvalue())
