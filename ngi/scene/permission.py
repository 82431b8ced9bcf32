"""Which files a scene may read: those of its own folder, and where its user says so, others."""

from __future__ import annotations

import os
from pathlib import Path

ASSETS = "NGI_ASSETS"
"""Environment variable: further folders that scenes may read from, as in PATH."""


def allowed_file(folder: Path, name: str, *, within: Path, where: str) -> Path:
    """The file that a scene names, counted from `folder`.

    within: the scene's folder, which it has to lie in once symlinks are followed, or else in one
        of those in $NGI_ASSETS. where: the file and the key that name it, for the message.

    Raises ValueError for a file elsewhere, and FileNotFoundError where there is no regular file.
    """
    path = folder / name
    try:
        real, exists = path.resolve(), path.is_file()
    except (OSError, ValueError, RuntimeError) as error:  # NUL, too long, symlinks in a circle
        raise ValueError(f"{where} names {name[:80]!r}, which is no file: {error}") from None
    if not any(real.is_relative_to(place) for place in (within.resolve(), *_assets())):
        raise ValueError(
            f"{where} names '{name}', which is {real}, outside of the scene's folder {within}; "
            f"bring it there, or allow it where you trust the scene: {ASSETS}={real.parent}"
        )
    if not exists:
        raise FileNotFoundError(
            f"{where} names '{name}', which is not there; bring the file to {path} or correct the "
            "name"
        )
    return path


def _assets() -> list[Path]:
    return [Path(part).resolve() for part in os.environ.get(ASSETS, "").split(os.pathsep) if part]
