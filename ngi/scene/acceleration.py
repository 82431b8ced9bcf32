"""Moves shapes in Embree's acceleration structure without having Mitsuba build it anew.

When a shape changes, Mitsuba 3.9 throws away the structures of all shape groups and builds them
again, on one thread, with the structure above them. That takes 30 to 250 ms for the paper's scenes,
longer than tracing a patch. Embree itself needs to be told only what moved: a group's structure is
left alone, and the one above it, over a few instances and lamps, takes less than a millisecond.

Mitsuba has no function for that, but its wheels bring Embree as a separate library. Here Embree's
functions are called on the scene that Mitsuba has made. They are called only if all that can be
checked looks as in the version this was written for. Otherwise Mitsuba builds, and only time is
lost.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ngi.machine.backend import dr, mi
from ngi.scene.jit_variables import address, variables_of

_LIBRARY = "libembree3.so"
_PREFIX = "_ZN7mitsuba"
"""Mitsuba has Embree in its own namespace."""

_INDICES, _VERTICES = 0, 1  # RTC_BUFFER_TYPE_INDEX, RTC_BUFFER_TYPE_VERTEX
_UINT3, _FLOAT3 = 0x5003, 0x9003  # RTC_FORMAT_UINT3, RTC_FORMAT_FLOAT3
_COLUMNS = 0x9244  # RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR

_pointer, _unsigned, _size = ctypes.c_void_p, ctypes.c_uint, ctypes.c_size_t
_FUNCTIONS: dict[str, tuple[str, type | None, list[type]]] = {
    "get": ("14rtcGetGeometryEPNS_10RTCSceneTyEj", _pointer, [_pointer, _unsigned]),
    "set_transform": (
        "23rtcSetGeometryTransformEPNS_13RTCGeometryTyEjNS_9RTCFormatEPKv",
        None,
        [_pointer, _unsigned, _unsigned, _pointer],
    ),
    "set_buffer": (
        "26rtcSetSharedGeometryBufferEPNS_13RTCGeometryTyENS_13RTCBufferTypeEjNS_9RTCFormatEPKvmmm",
        None,
        [_pointer, _unsigned, _unsigned, _unsigned, _pointer, _size, _size, _size],
    ),
    "commit_geometry": ("17rtcCommitGeometryEPNS_13RTCGeometryTyE", None, [_pointer]),
    "commit_scene": ("14rtcCommitSceneEPNS_10RTCSceneTyE", None, [_pointer]),
}
"""What is needed of Embree 3: mangled name without the prefix, result, arguments."""

_INTERSECT = (
    "13rtcIntersect4EPKiPNS_10RTCSceneTyEPNS_19RTCIntersectContextEPNS_10RTCRayHit4E",
    "13rtcIntersect8EPKiPNS_10RTCSceneTyEPNS_19RTCIntersectContextEPNS_10RTCRayHit8E",
    "14rtcIntersect16EPKiPNS_10RTCSceneTyEPNS_19RTCIntersectContextEPNS_11RTCRayHit16E",
)
"""One of them, whichever suits the width of Dr.Jit's vectors, is what a scene is traced with."""


class EmbreeScene:
    """The top level of a scene's acceleration structure: instances, and shapes in no group."""

    def __init__(self, library: ctypes.CDLL, handle: int, shapes: list[mi.Shape]) -> None:
        self._handle = handle
        self._index = {shape: i for i, shape in enumerate(shapes)}
        self._call = {}
        for name, (symbol, result, arguments) in _FUNCTIONS.items():
            function = library[_PREFIX + symbol]
            function.restype, function.argtypes = result, arguments
            self._call[name] = function

    @classmethod
    def of(cls, scene: mi.Scene) -> EmbreeScene | None:
        """That of a loaded scene, or None where not everything is as expected."""
        path = Path(mi.__file__).parent / _LIBRARY
        if mi.variant() != "llvm_ad_rgb" or not path.is_file():
            return None
        library = ctypes.CDLL(str(path))
        try:
            handle = _handle(scene, library)
            return None if handle is None else cls(library, handle, scene.shapes())
        except AttributeError:  # a function is not there
            return None

    def __contains__(self, shape: mi.Object) -> bool:
        return shape in self._index

    def move(self, shapes: Mapping[mi.Shape, NDArray[np.float64] | None]) -> None:
        """Takes note of where these shapes are now, once no kernel is tracing any more.

        shapes: with the to_world [4, 4] of instances; it is not looked at of others.
        """
        meshes = [shape for shape in shapes if isinstance(shape, mi.Mesh)]
        dr.eval([(mesh.vertex_positions_buffer(), mesh.faces_buffer()) for mesh in meshes])
        dr.sync_thread()  # until nobody traces any more, and the vertices are there
        for shape, to_world in shapes.items():
            geometry = self._call["get"](self._handle, self._index[shape])
            if isinstance(shape, mi.Mesh):
                self._set_buffers(geometry, shape)
            elif shape.class_name() == "Instance":
                assert to_world is not None
                columns = np.ascontiguousarray(to_world.T, dtype=np.float32)
                self._call["set_transform"](geometry, 0, _COLUMNS, columns.ctypes.data)
            # Of any other shape Embree asks the bounds when it builds.
            self._call["commit_geometry"](geometry)
        self._call["commit_scene"](self._handle)

    def _set_buffers(self, geometry: int, mesh: mi.Mesh) -> None:
        """Both may be new: a rectangle makes its own whenever it moves."""
        for kind, form, array, count in (
            (_VERTICES, _FLOAT3, mesh.vertex_positions_buffer(), mesh.vertex_count()),
            (_INDICES, _UINT3, mesh.faces_buffer(), mesh.face_count()),
        ):
            self._call["set_buffer"](geometry, kind, 0, form, address(array), 0, 12, count)


def _handle(scene: mi.Scene, library: ctypes.CDLL) -> int | None:
    """The address of Embree's scene.

    The variables that Dr.Jit finds in a scene begin with two addresses: that of Embree's scene, and
    that of the function that intersects it. They are recognised by the second.
    """
    variables = variables_of(scene)
    if len(variables) < 2:
        return None
    handle, function = map(address, variables[:2])
    known = [ctypes.cast(library[_PREFIX + name], ctypes.c_void_p).value for name in _INTERSECT]
    return handle if function in known else None
