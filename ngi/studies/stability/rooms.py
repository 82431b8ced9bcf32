"""Small scene folders for cases of light, material and geometry, with a renderer of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import torch
import yaml
from torch import Tensor

from ngi.render.protocol import Renderer
from ngi.render.workers import mitsuba_renderer
from ngi.scene import read_scene

RESOLUTION = 32
"""Of the virtual image: a patch shows all of it."""

LAMP = """
<shape type="rectangle" id="lamp">
  <transform name="to_world">
    <scale value="{half}"/><rotate x="1" angle="90"/><translate y="1.9"/>
  </transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
  <emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter>
</shape>"""

FLOOR = """
<shape type="rectangle" id="floor">
  <transform name="to_world"><scale value="2"/><rotate x="1" angle="-90"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
</shape>"""

BALL = """
<shape type="sphere" id="{name}">
  <point name="center" x="{x}" y="0.7" z="0"/><float name="radius" value="{radius}"/>
  {bsdf}
</shape>"""

GREY = '<bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>'

SKY = '<emitter type="constant" id="sky"><rgb name="radiance" value="{radiance}"/></emitter>'

FURNACE = """
<bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.5"/></bsdf>
<shape type="sphere" id="room">
  <point name="center" x="0" y="1" z="0"/><float name="radius" value="3"/>
  <boolean name="flip_normals" value="true"/>
  <ref id="paint"/>
  <emitter type="area" id="glow"><rgb name="radiance" value="1"/></emitter>
</shape>"""
"""A closed room whose walls all have the same albedo and radiance."""

MOVING = {
    "object": "ball",
    "property": "translation",
    "minimum": [-0.1, 0, 0],
    "maximum": [0.1] * 3,
}


@dataclass(frozen=True, kw_only=True)
class Room:
    """A scene.

    shapes: of scene.xml, as XML
    variables: of scene.yaml
    origin: of the camera, which looks at (0, 0.7, 0)
    """

    shapes: str
    variables: tuple[Mapping[str, object], ...]
    depth: int = 8
    origin: tuple[float, float, float] = (0.0, 1.0, 2.5)

    @contextmanager
    def renderer(self, backend: str | None, *, samples: int) -> Iterator[Renderer]:
        """A renderer of it, at so many samples per pixel."""
        assert backend is not None
        with TemporaryDirectory() as name:
            folder = Path(name)
            self._write(folder)
            renderer = mitsuba_renderer(
                workers=0,
                cluster=None,
                scene=read_scene(folder),
                backend=backend,
                samples_per_pixel=samples,
                patch_size=RESOLUTION,
            )
            yield renderer
            renderer.close()

    def radiance(self, backend: str | None, *v: float, samples: int = 64) -> Picture:
        """What a patch that is the whole image shows at v."""
        with self.renderer(backend, samples=samples) as renderer:
            states = torch.tensor([[*v, 0.0, 0.0]])
            patches = renderer.render_patches(states, resolution=RESOLUTION, seed=1)
        return Picture(
            radiance=torch.expm1(patches.log_radiance[0].double()),
            finite=bool(patches.log_radiance.isfinite().all() and patches.buffers.isfinite().all()),
            repaired=patches.repaired,
            masked=patches.masked,
        )

    def _write(self, folder: Path) -> None:
        x, y, z = self.origin
        (folder / "scene.xml").write_text(
            f"""<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="{self.depth}"/></integrator>
<sensor type="perspective" id="camera">
  <float name="fov" value="50"/><float name="near_clip" value="0.0001"/>
  <transform name="to_world">
    <lookat origin="{x}, {y}, {z}" target="0, 0.7, 0" up="0, 1, 0"/>
  </transform>
  <film type="hdrfilm">
    <integer name="width" value="600"/><integer name="height" value="600"/>
  </film>
</sensor>
{self.shapes}
</scene>"""
        )
        content = {
            "name": "room",
            "scene": "scene.xml",
            "samples_per_pixel": 16,
            "max_depth": self.depth,
            "bounds": {"minimum": [-3, -3, -3], "maximum": [3, 4, 3]},
            "variables": [dict(variable) for variable in self.variables],
        }
        (folder / "scene.yaml").write_text(yaml.safe_dump(content))


@dataclass(frozen=True)
class Picture:
    """radiance: [32, 32, 3] linear; finite: buffers too; repaired, masked: of one patch."""

    radiance: Tensor
    finite: bool
    repaired: int
    masked: int

    @property
    def done(self) -> str:
        """What the renderer did about NaN and Inf."""
        if self.masked:
            return "pixels of NaN or Inf masked, counted"
        return "rendered again with another seed" if self.repaired else "nothing to repair"


def ball(bsdf: str = GREY, *, name: str = "ball", x: float = 0.0, radius: float = 0.5) -> str:
    """A sphere as XML."""
    return BALL.format(name=name, bsdf=bsdf, x=x, radius=radius)
