"""Small tagged scene files for the tests of `ngi.scene.release`."""

import numpy as np

from ngi.machine.backend import mi
from ngi.scene.release import read_release
from ngi.scene.variable_scene import VariableScene

PATH = '<integrator type="path"><integer name="max_depth" value="4"/></integrator>'
SENSOR = """<sensor type="perspective" id="camera">
  <transform name="to_world"><lookat origin="0, 1, 9" target="0, 1, 0" up="0, 1, 0"/></transform>
  <sampler type="independent"><integer name="sample_count" value="8"/></sampler>
  <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/></film>
</sensor>"""
BALL = '<shape type="sphere"><float name="radius" value="0.5"/></shape>'
GROUP = f'<shape type="shapegroup" id="balls">{BALL}</shape>'
ROOM = '<shape type="cube"><transform name="to_world"><scale value="6"/></transform></shape>'
WALL = '<bsdf type="{}" id="var_paint">{}</bsdf><shape type="sphere"><ref id="var_paint"/></shape>'
WHITE = '<rgb name="reflectance" value="1, 1, 1"/>'
TETRAHEDRON = """ply
format ascii 1.0
comment three corners on the axes
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 2 0
0 0 3
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""


def tags(count=None, low=None, extent=None, axis=None, angles=None, kind="vector"):
    """The tags as the format has them, those that are given."""
    parts = []
    if count is not None:
        parts.append(f'<integer name="num_parameters" value="{count}"/>')
    if low is not None:
        parts.append(f'<{kind} name="min_bounds" value="{low}"/>')
    if extent is not None:
        parts.append(f'<{kind} name="range_bounds" value="{extent}"/>')
    if axis is not None:
        parts.append(f'<vector name="rotation_axis" value="{axis}"/>')
    if angles is not None:
        parts.append(f'<float name="min_angle" value="{angles[0]}"/>')
        parts.append(f'<float name="range_angle" value="{angles[1]}"/>')
    return "\n".join(parts)


def write(folder, body, *, integrator=PATH, sensor=SENSOR):
    (folder / "tetrahedron.ply").write_text(TETRAHEDRON)
    path = folder / "scene.xml"
    path.write_text(
        f'<?xml version="1.0"?>\n<scene version="2.2.1">\n{integrator}\n{sensor}\n{body}\n</scene>'
    )
    return path


def read(folder, body, **options):
    write(folder, body, **options)
    return read_release(folder)


class Loaded:
    """A loaded scene, its parameters at some v, and what rays meet there."""

    def __init__(self, description) -> None:
        self.description = description
        self._variables = VariableScene(description)
        self.scene = self._variables.scene

    def at(self, *v):
        self._variables.apply(np.array(v, dtype=float))
        return mi.traverse(self.scene)

    def matrix(self, key, *v):
        return np.array(self.at(*v)[key].matrix, dtype=float).reshape(4, 4)

    def hit(self, origin, direction):
        """The point that a ray meets, None for none."""
        found = self.scene.ray_intersect(mi.Ray3f(mi.Point3f(*origin), mi.Vector3f(*direction)))
        return np.array(found.p, dtype=float).reshape(3) if found.is_valid() else None

    def emitted(self, origin, direction):
        """The radiance that comes from what the ray meets first, without its reflection."""
        found = self.scene.ray_intersect(mi.Ray3f(mi.Point3f(*origin), mi.Vector3f(*direction)))
        emitter = found.emitter(self.scene)
        return (
            np.zeros(3)
            if emitter is None
            else np.array(emitter.eval(found), dtype=float).reshape(3)
        )
