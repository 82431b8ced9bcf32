"""The vertices of mesh files."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from ngi.scene.variable import Values

_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}


def ply_vertices(path: Path) -> Values:
    """[n, 3]; ValueError for a file that does not begin with its vertices, or has fewer."""
    with path.open("rb") as file:
        order, count, properties = _header(path, file)
        names = [name for name, _ in properties]
        if not {"x", "y", "z"} <= set(names):
            raise ValueError(f"{path}: its vertices have no x, y, z, only {names}")
        if not 0 <= count <= path.stat().st_size:
            raise ValueError(f"{path}: {count} vertices in a file of {path.stat().st_size} bytes")
        if order is None:
            rows = _numbers(path, [file.readline().split()[: len(names)] for _ in range(count)])
            return rows.reshape(count, len(names))[:, [names.index(axis) for axis in "xyz"]]
        if len(set(names)) < len(names):
            raise ValueError(f"{path}: its vertices have a property twice: {names}")
        dtype = np.dtype([(name, order + _TYPES[kind]) for name, kind in properties])
        data = file.read(count * dtype.itemsize)
    if len(data) < count * dtype.itemsize:
        raise ValueError(f"{path}: it ends before its {count} vertices do")
    vertices = np.frombuffer(data, dtype, count)
    return np.stack([vertices[axis].astype(np.float64) for axis in "xyz"], axis=1)


def _header(path: Path, file: BinaryIO) -> tuple[str | None, int, list[tuple[str, str]]]:
    """Byte order (None for text), number of vertices, and names and types of their properties."""
    orders = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": None}
    order, count, properties, elements = None, 0, [], 0
    if file.readline().strip() != b"ply":
        raise ValueError(f"{path}: not a PLY file")
    while (words := file.readline().decode("latin-1").split()) != ["end_header"]:
        match words:
            case ["comment" | "obj_info", *_]:
                pass
            case ["format", name, _] if name in orders:
                order = orders[name]
            case ["element", name, number]:
                elements += 1
                if elements == 1 and name != "vertex":
                    raise ValueError(f"{path}: it begins with '{name}' instead of vertices")
                if not number.isdecimal():
                    raise ValueError(f"{path}: '{number[:40]}' elements of '{name}'")
                count = int(number[:18]) if elements == 1 else count
            case ["property", *_] if elements > 1:
                pass
            case ["property", kind, name] if kind in _TYPES:
                properties.append((name, kind))
            case _:
                raise ValueError(f"{path}: a PLY header with the line '{' '.join(words)}'")
    return order, count, properties


def obj_vertices(path: Path) -> Values:
    """[n, 3]."""
    with path.open("rb") as file:
        rows = [line.split()[1:4] for line in file if line.startswith(b"v ")]
    return _numbers(path, rows).reshape(-1, 3)


def _numbers(path: Path, rows: list[list[bytes]]) -> Values:
    """[n, k]; ValueError where a row has other numbers of numbers, or none."""
    try:
        return np.array(rows, dtype=np.float64)
    except ValueError as error:
        raise ValueError(
            f"{path}: its vertices are no numbers, or not of one count: {error}"
        ) from None
