"""Lights and the field of view that vary, against the inverse-square law and a pinhole."""

import subprocess
import sys

import numpy as np
import pytest
import torch

from ngi.machine.backend import llvm_problem
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene
from tests.render.optics import ORIGIN, SIZE, dot, on_plane, rays, rectangle, unit, write_scene

N = 12
ALBEDO = np.array([0.6, 0.4, 0.2])
INTENSITY = np.array([5.0, 6.0, 7.0])
PLACE = np.array([0.5, -0.25, 2.0])
WALL = rectangle(
    "wall", '<scale value="4"/>', '<bsdf type="diffuse"><rgb name="reflectance" value="0.6, 0.4, '
    '0.2"/></bsdf>',
)  # fmt: skip
POINT = """<emitter type="point" id="light"><point name="position" x="0.5" y="-0.25" z="2"/>
<rgb name="intensity" value="5, 6, 7"/></emitter>"""
SPOT = """<emitter type="spot" id="light"><transform name="to_world">
<lookat origin="0.5, -0.25, 2" target="0.5, -0.25, 0" up="0, 1, 0"/></transform>
<float name="cutoff_angle" value="20"/><float name="beam_width" value="10"/>
<rgb name="intensity" value="5, 6, 7"/></emitter>"""

MOVES = "{object: light, property: translation, minimum: [-1, -1, 0], maximum: [1, 1, 1]}"
AIMS = "{object: light, property: direction, minimum: [-30, -20], maximum: [30, 20]}"
CONE = "{object: light, property: cone, minimum: [15, 5], maximum: [35, 15]}"
FOV = "{object: camera, property: fov, minimum: 10, maximum: 50}"


def write(folder, light, *variables) -> None:
    write_scene(folder, shapes=WALL + light, variables=(), max_depth=2)
    text = (folder / "scene.yaml").read_text()
    lines = [line for line in text.splitlines() if "camera_path" not in line]
    lines[-1] = f"variables: [{', '.join(variables)}]}}"
    (folder / "scene.yaml").write_text("\n".join(lines))


@pytest.fixture(params=["llvm", "scalar"])
def load(request, tmp_path):
    if request.param == "llvm" and (problem := llvm_problem()) is not None:
        pytest.skip(problem)

    def load(light, *variables, **arguments):
        write(tmp_path, light, *variables)
        return MitsubaRenderer(
            scene=read_scene(tmp_path), backend=request.param, patch_size=4, **arguments
        )

    return load


def lit(place, falloff=lambda _: 1.0, fov=20.0):
    """[N, N, 3]: radiance of the wall under a light, mean over 8 x 8 points of every pixel.

    falloff: of unit directions from the light.
    """
    hit = on_plane(ORIGIN, rays(8 * N, fov), np.zeros(3), [0, 0, 1])
    towards = hit - place
    cosine = -unit(towards)[..., 2:]
    radiance = ALBEDO / np.pi * INTENSITY * falloff(unit(towards)) * cosine / dot(towards, towards)
    return radiance.reshape(N, 8, N, 8, 3).mean(axis=(1, 3))


def cone(axis, cutoff=20.0, beam=10.0):
    """All of it up to `beam` degrees from the axis, none from `cutoff` on, linear in between."""
    return lambda d: np.clip(
        (cutoff - np.degrees(np.arccos(dot(d, unit(np.array(axis)))))) / (cutoff - beam), 0, 1
    )


def axis(azimuth, elevation):
    a, e = np.radians([azimuth, elevation])
    return -np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])


def check(renderer, v, expected) -> None:
    image = renderer.render_image(torch.tensor(v), resolution=N, samples_per_pixel=256, seed=1)
    np.testing.assert_allclose(image.numpy(), expected, rtol=0.01, atol=0.02 * expected.max())


def test_a_point_light_lights_by_the_inverse_square_of_its_distance(load) -> None:
    renderer = load(POINT, MOVES)
    for v in ([0.5, 0.5, 0.0], [0.1, 0.9, 0.3], [0.8, 0.25, 1.0]):
        check(renderer, v, lit(PLACE + np.array([-1, -1, 0]) + np.array([2, 2, 1]) * v))


def test_a_spot_moves_turns_and_widens(load) -> None:
    renderer = load(SPOT, MOVES, AIMS, CONE)
    for v in ([0.5, 0.5, 0, 0.5, 0.5, 0.25, 0.5], [0.3, 0.6, 0.5, 0.7, 0.2, 0.9, 0.1]):
        place = PLACE + np.array([-1, -1, 0]) + np.array([2, 2, 1]) * v[:3]
        along = axis(-30 + 60 * v[3], -20 + 40 * v[4])
        check(renderer, v, lit(place, cone(along, 15 + 20 * v[5], 5 + 10 * v[6])))


def test_the_camera_sees_the_width_of_its_field_of_view(load) -> None:
    renderer = load(POINT, FOV, buffer_samples=1)
    vectors = torch.tensor([[0.0], [0.4], [1.0]])
    y, x = np.mgrid[:N, :N] + 0.5
    for (v,), matrix in zip(vectors.tolist(), renderer.projections(vectors).numpy(), strict=True):
        fov = 10 + 40 * v
        hit = on_plane(ORIGIN, rays(N, fov), np.zeros(3), [0, 0, 1])
        buffers = renderer.image_buffers(torch.tensor([v]), resolution=N).numpy()
        position = buffers[..., renderer.layout.slice("position")]
        np.testing.assert_allclose((2 * position - 1) * SIZE, hit, atol=1e-5)
        film = np.concatenate([position, np.ones((N, N, 1))], axis=-1) @ matrix.T
        np.testing.assert_allclose(film[..., 0] / film[..., 3], x / N, atol=1e-5)
        np.testing.assert_allclose(film[..., 1] / film[..., 3], y / N, atol=1e-5)
        check(renderer, [v], lit(PLACE, fov=fov))
    assert renderer.camera_part == slice(0, 0), "where the camera is does not vary"


@pytest.mark.parametrize("light", [POINT, SPOT])
def test_the_renderer_tells_where_a_light_without_a_surface_is(load, light) -> None:
    points = load(light, MOVES).moving_points
    for v in (torch.zeros(3), torch.tensor([0.25, 0.5, 1.0])):
        place = PLACE + [-1, -1, 0] + np.array([2, 2, 1]) * v.numpy()
        ((*position,),) = (points.weight @ v + points.offset).tolist()
        np.testing.assert_allclose((2 * np.array(position) - 1) * SIZE, place, atol=1e-5)


def test_no_other_variant_of_mitsuba_has_to_be_loaded_first(tmp_path) -> None:
    write(tmp_path, POINT, MOVES)
    program = (
        "from ngi.render.mitsuba_renderer import MitsubaRenderer as R; "
        "from ngi.scene import read_scene; "
        f"print(len(R(scene=read_scene({str(tmp_path)!r}), backend='scalar').moving_points.weight))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "1\n", done.stderr


def test_what_moves_a_light_changes_no_buffer(load) -> None:
    """They are rendered once."""
    renderer = load(SPOT, MOVES, AIMS)
    assert renderer._static
    assert not load(POINT, FOV)._static


def test_a_camera_with_a_lens_is_refused(tmp_path) -> None:
    write(tmp_path, POINT, MOVES)
    text = (tmp_path / "scene.xml").read_text()
    lens = '"thinlens"><float name="aperture_radius" value="0.1"/>'
    lens += '<float name="focus_distance" value="4"/>'
    text = text.replace('"perspective">', lens)
    (tmp_path / "scene.xml").write_text(text)
    with pytest.raises(ValueError, match=r"scene\.xml: the camera is a ThinLensCamera; make it"):
        MitsubaRenderer(scene=read_scene(tmp_path), backend="scalar", patch_size=4)
