"""Binary PLY files as the scenes' scripts write them, read independently of them."""

from pathlib import Path

import numpy as np


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertex table [n, attributes], of which the first three are the position, and triangles."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    vertices, faces = (int(line.split()[2]) for line in lines if line.startswith("element"))
    properties = [line for line in lines if line.startswith("property float")]
    split = vertices * len(properties) * 4
    table = np.frombuffer(body[:split], "<f4").reshape(vertices, -1)
    triangles = np.frombuffer(body[split:], [("count", "u1"), ("index", "<i4", 3)])
    assert len(triangles) == faces
    return table, triangles["index"]
