"""What CUDA must not record, since Dr.Jit 1.5 ends the process there (docs/upstream.md)."""

from pathlib import Path

import pytest
import torch

from ngi.machine.backend import activate, dr, llvm_problem, mi
from ngi.render import tracers
from ngi.render.first_hit import first_hit_of
from ngi.render.materials import collect_materials
from ngi.render.tracing import Window
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene

pytestmark = pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))

SCENE = """<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="2"/></integrator>
<sensor type="perspective"><transform name="to_world">
  <lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
  <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film>
</sensor>
<bsdf type="roughconductor" id="paint">
  <texture type="bitmap" name="specular_reflectance">
    <string name="filename" value="paint.png"/>{accel}</texture>
  <texture type="bitmap" name="alpha">
    <string name="filename" value="paint.png"/><boolean name="raw" value="true"/></texture></bsdf>
<shape type="rectangle" id="wall"><ref id="paint"/></shape>
<emitter type="constant" id="sky"/>
</scene>"""
WINDOW = Window(x=0, y=0, width=4, height=4, resolution=4)


def scene_with(accel: str, folder: Path) -> VariableScene:
    activate("llvm")
    pixels = torch.linspace(0.1, 1, 48).view(4, 4, 3).numpy()
    mi.Bitmap(pixels).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True).write(
        str(folder / "paint.png")
    )
    (folder / "scene.xml").write_text(SCENE.format(accel=accel))
    (folder / "scene.yaml").write_text(
        "{name: wall, scene: scene.xml, samples_per_pixel: 4, max_depth: 2,\n"
        "bounds: {minimum: [-1, -1, -1], maximum: [1, 1, 1]}, variables: [{object: wall,\n"
        "property: translation, minimum: [0, 0, 0], maximum: [0.1, 0, 0]}]}"
    )
    scene = VariableScene(read_scene(folder))
    scene.apply([0.5])
    return scene


@pytest.mark.parametrize(
    ("variant", "accel", "recordings"),
    [
        ("cuda_ad_rgb", "false", 0),
        ("cuda_ad_rgb", "False", 0),
        ("cuda_ad_rgb", "true", 2),
        ("llvm_ad_rgb", "false", 2),
    ],
)
def test_nothing_is_recorded_where_a_bitmap_is_not_for_the_texture_units(
    variant: str,
    accel: str,
    recordings: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    scene = scene_with(f'<boolean name="accel" value="{accel}"/>', tmp_path)
    first_hit = first_hit_of(
        scene, needed_only=False, trace_specular=False, trace_direct=False, trace_caustics=False
    )
    expected = tracers.tracer_of("llvm_ad_rgb", scene, first_hit)
    recorded, freeze = [], dr.freeze

    def counted(function, **options):
        recorded.append(function)
        return freeze(function, **options)

    monkeypatch.setattr(dr, "freeze", counted)
    tracer = tracers.tracer_of(variant, scene, first_hit)
    assert len(recorded) == recordings
    assert ("accel=false" in caplog.text) == (recordings == 0)
    for trace in ("radiance", "buffers"):
        options = {"samples": 4} | ({"seed": 3} if trace == "radiance" else {})
        one, other = (getattr(t, trace)(WINDOW, **options)() for t in (tracer, expected))
        assert torch.equal(one, other)


@pytest.mark.parametrize(("variant", "everywhere"), [("cuda_ad_rgb", True), ("llvm_ad_rgb", False)])
def test_textures_of_the_gpu_are_read_everywhere(
    variant: str, everywhere: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_with("", tmp_path)
    (material,) = collect_materials(scene.bsdfs())
    hit = dr.zeros(mi.SurfaceInteraction3f, 2)
    hit.uv = mi.Point2f(0.4, 0.7)
    nowhere = mi.Bool([False, False])
    assert not dr.any(material.albedo(hit, nowhere).x > 0)
    monkeypatch.setattr(mi, "variant", lambda: variant)
    for value in (material.albedo(hit, nowhere).x, material.roughness(hit, nowhere)):
        assert dr.all(value > 0) == everywhere
