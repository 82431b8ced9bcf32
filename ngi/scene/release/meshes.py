"""The vertices of mesh files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ngi.scene.variable import Values


def vertices(path: Path, kind: str) -> Values:
    """[n, 3], of a file of this kind ('ply' or 'obj'); those that no face has may be missing.

    Raises ValueError, with the file's name, for one that cannot be read.
    """
    import trimesh  # takes half a second, and only the authors' files need it

    with path.open("rb") as file:  # without a name: what the file refers to is not looked for
        try:
            mesh = trimesh.load_mesh(file, file_type=kind, process=False)
            found: Values = np.array(mesh.vertices, dtype=np.float64).reshape(-1, 3)
        except Exception as error:  # of nearly any class, as the file is damaged
            raise ValueError(
                f"{path}: cannot be read as {kind.upper()}: {type(error).__name__}: {error}"
            ) from error
    if not len(found):
        raise ValueError(f"{path}: no face has a vertex")
    return found
