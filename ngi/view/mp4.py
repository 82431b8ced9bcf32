"""MP4 files that every browser plays. Needs PyAV (`pip install -e .[video]`)."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ngi.files.durable import PARTIAL_SUFFIX
from ngi.files.extras import install_command

QUALITY = "16"
"""x264's constant rate factor: no difference to the pictures can be seen."""

BT709, SRGB = 1, 13
"""Primaries and matrix, and the transfer curve, as H.264 counts them."""

AddFrame = Callable[[NDArray[np.uint8]], None]


def pyav() -> ModuleType:
    """The package that writes videos; RuntimeError, saying how to get it, where it is missing."""
    try:
        import av
    except ImportError as error:
        raise RuntimeError(
            f"videos need PyAV, which is missing here; get it with `{install_command('video')}`"
        ) from error
    module: ModuleType = av
    return module


@contextmanager
def mp4_file(path: Path, *, frames_per_second: int) -> Iterator[AddFrame]:
    """Gives a function that adds a picture, [H, W, 3] uint8 sRGB, all of one size, at least one.

    H.264 with yuv420p, whose sides have to be even: odd ones grow by a row or column. The file
    gets its name when it is whole, and none where anything is raised.
    """
    av = pyav()
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    try:
        with av.open(str(partial), "w", "mp4", options={"movflags": "faststart"}) as container:
            stream = container.add_stream("libx264", frames_per_second, {"crf": QUALITY})

            def add(picture: NDArray[np.uint8]) -> None:
                height, width = picture.shape[:2]
                even = np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
                if not stream.codec_context.is_open:
                    stream.height, stream.width = even.shape[:2]
                    stream.pix_fmt = "yuv420p"
                    context = stream.codec_context
                    context.color_primaries = context.colorspace = BT709
                    context.color_trc = SRGB
                frame = av.VideoFrame.from_ndarray(even, format="rgb24")
                frame = frame.reformat(format="yuv420p", dst_colorspace=BT709)
                container.mux(stream.encode(frame))

            yield add
            container.mux(stream.encode())
        os.replace(partial, path)
    finally:
        with suppress(OSError):
            partial.unlink()
