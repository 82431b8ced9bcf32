"""Small good scenes of both formats, which between them use all that can be in one."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from tests.scene.release_files import BALL, GROUP, PATH, SENSOR, TETRAHEDRON, tags

XML = """<scene version="3.0.0">
<default name="depth" value="4"/><default name="mesh" value="a.ply"/>
<integrator type="path"><integer name="max_depth" value="$depth"/></integrator>
<sensor type="perspective" id="camera"><float name="fov" value="45"/>
  <transform name="to_world"><lookat origin="0, 1, 9" target="0, 1, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
</sensor>
<bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.5, 0.4, 0.3"/></bsdf>
<bsdf type="diffuse" id="other"><rgb name="reflectance" value="0.1, 0.4, 0.3"/></bsdf>
<bsdf type="roughconductor" id="metal"><string name="material" value="Cu"/>
  <float name="alpha" value="0.2"/></bsdf>
<bsdf type="diffuse" id="picture"><texture type="bitmap" name="reflectance">
  <string name="filename" value="a.png"/></texture></bsdf>
<shape type="sphere" id="ball"><ref id="paint"/></shape>
<shape type="ply" id="mesh"><string name="filename" value="$mesh"/><ref id="picture"/></shape>
<shape type="cube" id="cube"><ref id="metal"/></shape>
<shape type="rectangle" id="lamp"><transform name="to_world"><translate y="4"/></transform>
  <emitter type="area"><rgb name="radiance" value="9"/></emitter></shape>
<emitter type="directional" id="sun"><rgb name="irradiance" value="1"/></emitter>
</scene>"""
SCENE = """name: kit
scene: scene.xml
samples_per_pixel: 8
max_depth: 4
bounds: {minimum: [-2, -2, -2], maximum: [2, 4, 2]}
variables:
  - {object: paint, property: albedo, minimum: [0, 0, 0], maximum: [1, 1, 1], linked: true}
  - {object: metal, property: roughness, minimum: 0.1, maximum: 0.5}
  - {object: picture, property: texture, choices: [a.png, b.png]}
  - {object: ball, property: translation, minimum: [0, 0, 0], maximum: [1, 0, 1]}
  - {object: [ball], property: rotation, axis: [0, 1, 0], minimum: 0, maximum: 90}
  - {object: ball, property: scale, pivot: [0, 0, 0], minimum: 0.5, maximum: 2}
  - {object: cube, property: visibility}
  - {object: ball, property: material, choices: [paint, other]}
  - {object: mesh, property: key_frames, files: [a.ply, b.ply]}
  - {object: lamp, property: intensity, minimum: 0.5, maximum: 2}
  - {object: sun, property: direction, minimum: [0, 20], maximum: [90, 60]}
  - {object: camera, property: look_at, minimum: [0, 1, 9, 0, 0, 0], maximum: [1, 1, 9, 1, 0, 0]}
"""
OTHER = """name: kit
scene: scene.xml
samples_per_pixel: 8
max_depth: 4
bounds: &box {minimum: [-2, -2, -2], maximum: [2, 4, 2]}
variables:
  - {object: picture, property: texels, size: [2, 2], minimum: 0.1, maximum: 0.9}
  - {object: camera, property: camera_path, keys: [[0, 1, 9, 0, 0, 0], [1, 1, 9, 0, 0, 0]]}
  - {object: sun, property: radiance, minimum: [0, 0, 0], maximum: [1, 1, 1]}
  - {object: which, property: shape, choices: [ball, cube]}
variants: [4]
camera_path: [[0, 0, 0, 0, 0, 0, 0, 0, 0], [1, 1, 1, 1, 1, 1, 1, 1, 1]]
hard_frames: [[0, 0, 0.5, 0, 0, 0, 0, 0, 0]]
"""
SCENES = tuple(text.encode() for text in (SCENE, OTHER))


def _release(body: str, sensor: str = SENSOR) -> bytes:
    return f'<scene version="2.2.1">\n{PATH}\n{sensor}\n{body}\n</scene>'.encode()


_MESH = '<shape type="ply" id="{}"><string name="filename" value="a.ply"/>{}{}</shape>'
_MOVES = tags(3, "0, 0, 0", "1, 2, 1")
_LIGHT = '<emitter type="area"><rgb name="radiance" value="5"/></emitter>'
RELEASES = (
    _release(
        _MESH.format("var_mesh", tags(4, "0, 0, 0", "1, 1, 1", "0, 1, 0", (0, 90)), "")
        + f'<emitter type="point" id="var_lamp">{tags(1)}</emitter>'
        + f'<bsdf type="roughplastic" id="var_paint">{tags(4)}</bsdf>'
        + '<shape type="cube"><ref id="var_paint"/><transform name="to_world">'
        + '<scale value="6"/><rotate x="1" angle="90"/><matrix value="1 0 0 0 1 0 0 0 1"/>'
        + "</transform></shape>",
        SENSOR.replace('id="camera">', f'id="var_camera">{tags(5)}'),
    ),
    _release(
        '<default name="high" value="2"/>'
        + GROUP
        + f'<shape type="instance" id="var_one">{tags(1, "0, 0, 0", "0, $high, 0")}'
        + '<ref id="balls"/></shape>'
        + f'<shape type="shapegroup" id="var_choice">{tags(1)}{BALL}'
        + f'<shape type="cube">{_LIGHT}</shape></shape>'
        + '<shape type="instance"><ref id="var_choice"/></shape>'
        + f'<shape type="cylinder" id="var_rod">{_MOVES}<float name="radius" value="2"/></shape>'
        + '<shape type="rectangle"/><shape type="disk"/>',
    ),
    _release(
        f'<bsdf type="twosided" id="paper"><bsdf type="diffuse" id="var_page">{tags(1)}'
        + '<texture type="bitmap" name="reflectance"><string name="filename" value="a.png"/>'
        + '</texture><texture type="bitmap" name="reflectance">'
        + '<string name="filename" value="b.png"/></texture></bsdf></bsdf>'
        + '<shape type="rectangle" id="page"><ref id="paper"/></shape>'
        + f'<shape type="sphere"><bsdf type="diffuse" id="var_c">{tags(3)}</bsdf></shape>'
        + f'<emitter type="envmap" id="var_sky"><string name="filename" value="a.png"/>{tags(1)}'
        + "</emitter>"
    ),
)


def write_seed(folder: Path) -> None:
    """All that the scenes name, and scene.xml."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.xml").write_text(XML)
    for name, shade in (("a", 40), ("b", 200)):
        (folder / f"{name}.ply").write_text(TETRAHEDRON)
        Image.new("RGB", (2, 2), (shade, 90, 30)).save(folder / f"{name}.png")
