"""Caustics against closed forms, and against Mitsuba's path tracer behind a glass sphere."""

import numpy as np
import pytest
import torch

from ngi.machine.backend import llvm_problem, mi
from ngi.render.caustics import Caustics, photon_points
from ngi.render.first_hit import first_hit_of
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene
from tests.render.optics import ORIGIN, dot, fresnel, on_plane, rays, rectangle, unit, write_scene
from tests.render.seedless import assert_seedless
from tests.render.test_direct_light import (
    ALBEDO,
    BLACK,
    BULB,
    BULB_AT,
    DIFFUSE,
    DIM,
    FLOOR,
    INTENSITY,
    MIRROR,
    PAINT,
    REFLECTANCE,
)

RESOLUTION = 24
WALL_AT = 2.2
WALL = f'<rotate y="1" angle="-90"/><scale value="2"/><translate x="{WALL_AT}"/>'
LAMP_BEHIND = BULB_AT * [-1, 1, 1] + [2 * WALL_AT, 0, 0]
PANE = '<scale value="2"/><translate z="1"/>'
THIN = '<bsdf type="thindielectric" id="thin"><float name="int_ior" value="1.5"/></bsdf>'
TABLE = '<bsdf type="diffuse" id="top"><rgb name="reflectance" value="0.5"/></bsdf>'
ROUGH = MIRROR.replace('"conductor"', '"roughconductor"').replace(
    "</bsdf>", '<float name="alpha" value="0.02"/></bsdf>'
)
GLASS = '<bsdf type="dielectric" id="glass"><float name="int_ior" value="1.5"/></bsdf>'
LAMP_RADIUS = 0.01
BLOCK = f"""<shape type="cube" id="block"><transform name="to_world">
    <scale x="0.1" y="2" z="3"/><translate x="{{x}}"/></transform>{MIRROR}</shape>"""


def lamp(factor=1.0):
    """A ball where the bulb is, as bright, that a path can meet by chance."""
    radiance = ", ".join(map(str, factor * INTENSITY / (np.pi * LAMP_RADIUS**2)))
    return f'''<shape type="sphere" id="globe"><float name="radius" value="{LAMP_RADIUS}"/>
        <point name="center" value="{", ".join(map(str, BULB_AT))}"/>{BLACK}
        <emitter type="area" id="bulb"><rgb name="radiance" value="{radiance}"/></emitter>
        </shape>'''


LAMP = lamp()


@pytest.fixture
def load(tmp_path):
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)

    def load(shapes, *, variables=(DIM,), max_depth=5, direct="with_caustics", **arguments):
        write_scene(tmp_path, shapes=shapes, variables=variables, max_depth=max_depth, fov=40)
        arguments = {"backend": "llvm", "patch_size": 8, "buffer_samples": 4} | arguments
        return MitsubaRenderer(scene=read_scene(tmp_path), direct=direct, **arguments)

    return load


def direct(renderer, v=None, resolution=RESOLUTION):
    """[n, n, 3] linear radiance."""
    v = torch.zeros(renderer.dimensions) if v is None else torch.tensor(v)
    image = renderer.image_buffers(v, resolution=resolution)
    return image[..., renderer.layout.slice("direct")].expm1().numpy()


def of_a_lamp(at, normal=(0, 0, 1)):
    """Radiance of the floor, lit by the lamp at a place: as by a point (Lambertian spheres are)."""
    floor = on_plane(ORIGIN, rays(RESOLUTION, fov=40), np.zeros(3), normal)
    away = np.asarray(at) - floor
    cosine = dot(unit(away), np.asarray(normal))
    return ALBEDO / np.pi * INTENSITY * cosine / dot(away, away)


def assert_close(found, expected, *, mean, rms):
    """mean, rms: relative errors allowed of the picture's mean, and of its pixels."""
    assert found.mean() == pytest.approx(expected.mean(), rel=mean)
    assert np.sqrt(np.square(found - expected).mean() / np.square(expected).mean()) < rms


@pytest.mark.parametrize("degrees", [0, 30])
def test_a_mirror_lights_the_floor_as_the_lamp_behind_it_would(load, degrees) -> None:
    """Also where the floor is at an angle to the cells."""
    floor = FLOOR.replace(
        '<scale value="4"/>', f'<scale value="4"/><rotate y="1" angle="{degrees}"/>'
    )
    shapes = floor + LAMP + rectangle("wall", WALL, MIRROR)
    added = direct(load(shapes)) - direct(load(shapes, direct="traced"))
    normal = [np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))]
    assert_close(added, REFLECTANCE * of_a_lamp(LAMP_BEHIND, normal), mean=0.02, rms=0.15)


def test_light_goes_through_a_pane(load) -> None:
    """Straight on, as if there were none, but for what its two faces reflect to and fro."""
    shapes = FLOOR + LAMP + rectangle("pane", PANE, THIN)
    floor = on_plane(ORIGIN, rays(RESOLUTION, fov=40), np.zeros(3), [0, 0, 1])
    reflects = fresnel(unit(BULB_AT - floor)[..., 2:], 1.5)
    passes = (1 - reflects) / (1 + reflects)
    seen = load(shapes, specular="traced")
    image = seen.image_buffers(torch.zeros(1), resolution=RESOLUTION)
    throughput = image[..., seen.layout.slice("throughput")].numpy()
    assert_close(direct(seen), throughput * passes * of_a_lamp(BULB_AT), mean=0.02, rms=0.15)


def test_refraction_leaves_a_photons_flux_as_it_is(load, tmp_path) -> None:
    """Under water, where radiance is greater than above it by the index squared and light is not.

    What leaves the bulb within an angle of the vertical arrives within a circle on the floor.
    """
    index, height, depth = 1.5, BULB_AT[2] - 1, 1.0
    load(FLOOR + LAMP + rectangle("water", PANE, GLASS))
    scene = VariableScene(read_scene(tmp_path))
    options = {"needed_only": True, "trace_specular": False, "trace_direct": True}
    caustics = first_hit_of(scene, trace_caustics=True, **options).caustics
    traced = caustics.trace(scene.scene, photon_points())
    sines = np.linspace(0.05, 0.75, 200)
    below = np.sqrt(1 - (sines / index) ** 2)
    cosines = np.sqrt(1 - sines**2)
    radii = height * sines / cosines + depth * sines / index / below
    enters = 1 - fresnel(cosines, index)
    rings = np.pi * np.diff(radii**2)
    flux = 2 * np.pi * -np.diff(cosines) * (enters[1:] + enters[:-1]) / 2
    for radius in (0.3, 0.6, 0.9):
        expected = ALBEDO / np.pi * INTENSITY * np.interp(radius, radii[1:], flux / rings)
        x, y = float(BULB_AT[0]) + radius, float(BULB_AT[1])
        hit = scene.scene.ray_intersect(mi.Ray3f([x, y, 0.5], [0, 0, -1]))
        np.testing.assert_allclose(caustics.radiance(traced, hit).numpy()[:, 0], expected, rtol=0.2)


def test_the_back_of_a_one_sided_surface_shows_no_light(load) -> None:
    """As in Mitsuba, where it is black."""
    turned = FLOOR.replace('<scale value="4"/>', '<scale value="4"/><rotate x="1" angle="180"/>')
    twosided = f'<bsdf type="twosided" id="both">{DIFFUSE}</bsdf>'
    wall = rectangle("wall", WALL, MIRROR)
    assert (direct(load(turned + LAMP + wall)) == 0).all()
    both = direct(load(turned.replace(DIFFUSE, twosided) + LAMP + wall))
    np.testing.assert_allclose(both, direct(load(FLOOR + LAMP + wall)), rtol=0.01, atol=1e-4)


def test_a_mirror_that_moves_and_grows_is_where_it_is(load, monkeypatch) -> None:
    """A mesh that moves is an instance: as the same mesh that stands there, other photons."""
    monkeypatch.setattr("ngi.render.caustics.PHOTONS", 2**16)
    moves = "{object: block, property: translation, minimum: [0, 0, 0], maximum: [1, 0, 0]}"
    grows = "{object: block, property: scale, minimum: 1, maximum: 1.5, pivot: [1.5, 0, 0]}"
    plain = direct(load(FLOOR + LAMP))
    there = direct(load(FLOOR + LAMP + BLOCK.format(x=2))) - plain
    moved = direct(load(FLOOR + LAMP + BLOCK.format(x=1.5), variables=[moves]), [0.5]) - plain
    assert_close(moved, there, mean=0.03, rms=0.2)
    large = BLOCK.format(x=1.5).replace('x="0.1" y="2" z="3"', 'x="0.15" y="3" z="4.5"')
    expected = direct(load(FLOOR + LAMP + large)) - plain
    grown = direct(load(FLOOR + LAMP + BLOCK.format(x=1.5), variables=[grows]), [1.0]) - plain
    assert_close(grown, expected, mean=0.03, rms=0.2)
    assert abs(expected - there).mean() > 0.1 * there.mean()


def test_a_wall_is_a_mirror_where_a_variable_says_so(load) -> None:
    dressed = "{object: wall, property: material, choices: [top, silver]}"
    wall = rectangle("wall", WALL, '<ref id="top"/>')
    varies = load(TABLE + MIRROR + FLOOR + LAMP + wall, variables=[dressed])
    fixed = load(FLOOR + LAMP + rectangle("wall", WALL, MIRROR))
    plain = load(FLOOR + LAMP + rectangle("wall", WALL, TABLE))
    np.testing.assert_array_equal(direct(varies, [1.0]), direct(fixed))
    np.testing.assert_array_equal(direct(varies, [0.0]), direct(plain))
    assert direct(fixed).mean() > 1.1 * direct(plain).mean()


def test_a_glass_sphere_focuses_what_mitsuba_says(load) -> None:
    """The whole of the light in the sphere's shadow, and that it is a spot."""
    ball = f'<shape type="sphere" id="ball"><point name="center" x="1" y="0.8" z="0.6"/>\
<float name="radius" value="0.4"/>{GLASS}</shape>'
    lamp = '<shape type="sphere" id="lamp"><point name="center" x="3" y="2.4" z="3"/>\
<float name="radius" value="0.5"/><emitter type="area" id="bulb"><rgb name="radiance" \
value="30, 20, 10"/></emitter></shape>'
    vary = PAINT.replace("[0, 0, 0]", "[0.8, 0.5, 0.2]")
    renderer = load(FLOOR + ball + lamp, variables=[vary], max_depth=8, buffer_samples=16)
    plain = load(
        FLOOR + ball + lamp, variables=[vary], max_depth=8, buffer_samples=16, direct="traced"
    )
    v = torch.zeros(3)
    truth = renderer.render_image(v, resolution=48, samples_per_pixel=1024, seed=0).numpy()
    added = direct(renderer, resolution=48) - direct(plain, resolution=48)
    missing = truth - direct(plain, resolution=48)
    shadow = slice(16, 26), slice(24, 34)  # about the shadow's centre, beside the sphere
    assert missing[shadow].max() > 2 * truth.mean()
    assert added[shadow].sum() == pytest.approx(missing[shadow].sum(), rel=0.1)
    assert np.corrcoef(added[shadow].ravel(), missing[shadow].ravel())[0, 1] > 0.9


def test_there_is_no_seed_and_patches_show_the_image(load) -> None:
    turns = "{object: block, property: translation, minimum: [0, 0, 0], maximum: [1, 0, 0]}"
    renderer = load(FLOOR + LAMP + BLOCK.format(x=1.5), variables=[turns, DIM])
    assert_seedless(renderer)


WITHOUT = {
    "no path meets a point by way of a mirror": (FLOOR + BULB + rectangle("wall", WALL, MIRROR), 5),
    "nothing is specular": (FLOOR + LAMP, 5),
    "paths are too short": (FLOOR + LAMP + rectangle("wall", WALL, MIRROR), 2),
}


def test_no_path_meets_a_point_by_way_of_a_smooth_mirror(load, monkeypatch) -> None:
    """As Mitsuba says; of a lamp in the same scene, which half of the photons come from, the
    caustic is there.
    """
    monkeypatch.setattr("ngi.render.caustics.PHOTONS", 2**14)
    wall = rectangle("wall", WALL, MIRROR)
    renderer = load(FLOOR + BULB + wall, max_depth=3)
    image = renderer.render_image(
        torch.zeros(1), resolution=RESOLUTION, samples_per_pixel=64, seed=0
    )
    np.testing.assert_allclose(direct(renderer), image, rtol=0.02)
    lamp = LAMP.replace('"bulb"', '"other"')
    both = direct(load(FLOOR + BULB + lamp + wall, buffer_samples=16))
    plain = direct(load(FLOOR + BULB + lamp + wall, buffer_samples=16, direct="traced"))
    assert_close(both - plain, REFLECTANCE * of_a_lamp(LAMP_BEHIND), mean=0.02, rms=0.15)


def test_a_rough_mirror_lights_the_floor_with_a_point(load) -> None:
    """Nearly as a smooth one would with a lamp; Mitsuba's paths meet the point from there."""
    shapes = FLOOR + BULB + rectangle("wall", WALL, ROUGH)
    added = direct(load(shapes)) - direct(load(shapes, direct="traced"))
    assert_close(added, REFLECTANCE * of_a_lamp(LAMP_BEHIND), mean=0.02, rms=0.15)


def test_however_bright_an_emitter_is(load) -> None:
    """Caustics are in proportion to it: none is cut off, and none is blurred for being dim."""

    def added(factor):
        shapes = FLOOR + lamp(factor) + rectangle("wall", WALL, MIRROR)
        return direct(load(shapes)) - direct(load(shapes, direct="traced"))

    usual = added(1)
    assert usual.mean() > 0.01
    for factor in (1e-7, 1e9):
        found = added(factor) / factor
        np.testing.assert_allclose(found, usual, rtol=2e-3, atol=1e-3 * usual.max())


@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_coat_takes_its_share_of_the_light_that_falls_through_it(load, nonlinear) -> None:
    """Going in, as if from straight above, and out; the base throws back some of what the coat
    throws back to it (Burley 2015; Mitsuba's `plastic`).
    """
    index = 1.49
    coated = DIFFUSE.replace('"diffuse"', '"plastic"').replace("reflectance", "diffuse_reflectance")
    option = f'<boolean name="nonlinear" value="{str(nonlinear).lower()}"/></bsdf>'
    shapes = FLOOR.replace(DIFFUSE, coated.replace("</bsdf>", option)) + LAMP
    shapes += rectangle("wall", WALL, MIRROR)
    added = direct(load(shapes)) - direct(load(shapes, direct="traced"))
    cosines = (np.arange(10_000) + 0.5) / 10_000
    inside = (2 * cosines * fresnel(cosines, 1 / index)).mean()
    seen_at = -rays(RESOLUTION, fov=40)[..., 2:]
    coat = (1 - fresnel(np.array(1.0), index)) * (1 - fresnel(seen_at, index))
    share = coat / index**2 / (1 - (ALBEDO if nonlinear else 1) * inside)
    assert_close(added, REFLECTANCE * of_a_lamp(LAMP_BEHIND) * share, mean=0.02, rms=0.1)


def test_a_principled_floor_shows_them_by_its_base_colour(load, monkeypatch) -> None:
    """Looked up as its albedo is: on CUDA a method of a BSDF called by itself, with a mask, reads a
    texture for some threads only, which ends the process (docs/upstream.md).
    """
    monkeypatch.delattr(mi.BSDF, "eval_diffuse_reflectance")
    floor = DIFFUSE.replace('"diffuse"', '"principled"').replace("reflectance", "base_color")
    shapes = FLOOR.replace(DIFFUSE, floor) + LAMP + rectangle("wall", WALL, MIRROR)
    added = direct(load(shapes)) - direct(load(shapes, direct="traced"))
    assert_close(added, REFLECTANCE * of_a_lamp(LAMP_BEHIND), mean=0.02, rms=0.1)


def test_few_photons_blur_but_lose_no_light(load, monkeypatch) -> None:
    monkeypatch.setattr("ngi.render.caustics.PHOTONS", 2**8)
    shapes = FLOOR + LAMP + rectangle("wall", WALL, MIRROR)
    added = direct(load(shapes)) - direct(load(shapes, direct="traced"))
    assert_close(added, REFLECTANCE * of_a_lamp(LAMP_BEHIND), mean=0.1, rms=0.3)


@pytest.mark.parametrize("why", WITHOUT)
def test_a_scene_without_caustics_has_its_direct_light(load, why) -> None:
    shapes, max_depth = WITHOUT[why]
    with_caustics, traced = (
        direct(load(shapes, max_depth=max_depth, direct=choice))
        for choice in ("with_caustics", "traced")
    )
    assert traced.max() > 0
    np.testing.assert_array_equal(with_caustics, traced)


def test_light_stays_on_the_side_of_the_surface_that_it_falls_on(load, tmp_path) -> None:
    """A table reaches from the mirror over the floor: only its top is lit."""
    table = rectangle("table", '<scale value="1.4"/><translate x="0.8" z="1.2"/>', TABLE)
    load(FLOOR + LAMP + table + rectangle("wall", WALL, MIRROR))
    scene = VariableScene(read_scene(tmp_path))
    options = {"needed_only": True, "trace_specular": False, "trace_direct": True}
    caustics = first_hit_of(scene, trace_caustics=True, **options).caustics
    traced = caustics.trace(scene.scene, photon_points())

    def seen(start, direction):
        ray = mi.Ray3f([0.8, 0, start], [0, 0, direction])
        return caustics.radiance(traced, scene.scene.ray_intersect(ray)).numpy()

    away = LAMP_BEHIND - [0.8, 0, 1.2]
    expected = REFLECTANCE * 0.5 / np.pi * INTENSITY * unit(away)[2] / dot(away, away)
    np.testing.assert_allclose(seen(2, -1)[:, 0], expected, rtol=0.25)
    assert (seen(1, 1) == 0).all(), "the table from below"
    assert (seen(1, -1) == 0).all(), "the floor under it"


def test_python_is_too_slow_for_photons(load) -> None:
    with pytest.raises(ValueError, match=r"too slow; see .* with renderer\.direct=traced"):
        load(FLOOR + LAMP, backend="scalar")


def test_photons_are_traced_again_where_more_than_the_camera_moves(load, monkeypatch) -> None:
    traced = []

    def trace(*arguments):
        traced.append(arguments)
        return of_class(*arguments)

    of_class = Caustics.trace
    monkeypatch.setattr(Caustics, "trace", trace)
    monkeypatch.setattr("ngi.render.jit_tracer.dr.freeze", lambda function, **_: function)
    walks = (
        "{object: camera, property: look_at, minimum: [0, 0, 4, 0, 0, 0], "
        "maximum: [1, 0, 4, 0, 0, 0], up: [0, 1, 0]}"
    )
    zooms = "{object: camera, property: fov, minimum: 15, maximum: 25}"
    shapes = FLOOR + LAMP + rectangle("wall", WALL, MIRROR)

    def renderer():
        return load(shapes, variables=[DIM, walks, zooms])

    dim, bright = ([0.2, 0.0, 0.5], [0.2, 1.0, 0.5], [0.2, 1.0, 0.9]), [0.9, 1.0, 0.9]
    seen, vectors = renderer(), (*dim, bright, dim[1], dim[1])
    pictures = [(direct(seen, v), len(traced)) for v in vectors]
    assert [count for _, count in pictures] == [1, 1, 1, 2, 3, 3]
    fresh = {tuple(v): direct(renderer(), v) for v in vectors[:4]}  # the others repeat one
    for v, (picture, _) in zip(vectors, pictures, strict=True):
        np.testing.assert_array_equal(picture, fresh[tuple(v)])


def test_few_pixels_can_be_had_without_any_photons(load, monkeypatch) -> None:
    """As a renderer that knows no caustics has them; in between they are there as ever."""
    of_class, traced = Caustics.trace, []
    monkeypatch.setattr(Caustics, "trace", lambda *a: traced.append(a) or of_class(*a))
    monkeypatch.setattr("ngi.render.jit_tracer.dr.freeze", lambda function, **_: function)
    shapes = FLOOR + LAMP + rectangle("wall", WALL, MIRROR)
    pixels = torch.tensor([7, 5 * RESOLUTION + 3, RESOLUTION**2 - 1])
    renderer, ignorant = load(shapes), load(shapes, direct="traced")
    light = renderer.layout.slice("direct")
    for count, v in enumerate((torch.zeros(1), torch.ones(1))):
        without = renderer.pixel_buffers(v, pixels, resolution=RESOLUTION, caustics=False)
        expected = ignorant.pixel_buffers(v, pixels, resolution=RESOLUTION)
        torch.testing.assert_close(without, expected, atol=1e-5, rtol=0)
        assert len(traced) == count
        image = renderer.image_buffers(v, resolution=RESOLUTION).flatten(0, 1)
        lit = renderer.pixel_buffers(v, pixels, resolution=RESOLUTION)
        torch.testing.assert_close(lit, image[pixels], atol=1e-5, rtol=0)
        assert lit[:, light].sum() > without[:, light].sum()
