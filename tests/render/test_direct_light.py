"""Traced direct light against closed forms; `test_shipped_scenes` compares whole scenes."""

import numpy as np
import pytest
import torch

from ngi.machine.backend import llvm_problem
from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer
from ngi.render.direct_light import light_points
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.render.tracing import subpixel_points
from ngi.scene import read_scene
from tests.render.optics import ORIGIN, on_plane, rays, rectangle, unit, write_scene
from tests.render.seedless import assert_seedless
from tests.render.trained import stored_buffers

RESOLUTION = 16
ALBEDO = np.array([0.8, 0.5, 0.2])
DIFFUSE = '<bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.8, 0.5, 0.2"/></bsdf>'
BLACK = '<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>'
MIRROR = '<bsdf type="conductor" id="silver"><string name="material" value="none"/>\
<rgb name="specular_reflectance" value="0.9, 0.8, 0.7"/></bsdf>'
REFLECTANCE = np.array([0.9, 0.8, 0.7])
FLOOR = rectangle("floor", '<scale value="4"/>', DIFFUSE)
BULB = '<emitter type="point" id="bulb"><point name="position" value="0.5, 0.2, 2"/>\
<rgb name="intensity" value="6, 4, 2"/></emitter>'
BULB_AT, INTENSITY = np.array([0.5, 0.2, 2.0]), np.array([6.0, 4.0, 2.0])
GLOBE = '<shape type="sphere" id="globe"><point name="center" value="1.5, 0, 1"/>\
<float name="radius" value="0.3"/><emitter type="area"><rgb name="radiance" value="6, 4, 2"/>\
</emitter></shape>'
SKY = '<emitter type="constant" id="sky"><rgb name="radiance" value="0.5, 1, 2"/></emitter>'
DIM = "{object: bulb, property: intensity, minimum: 1, maximum: 2}"
PAINT = "{object: paint, property: albedo, minimum: [0, 0, 0], maximum: [1, 1, 1]}"


@pytest.fixture
def load(tmp_path):
    def load(shapes, *, backend, variables=(DIM,), max_depth=5, **arguments):
        picture = np.random.default_rng(0).integers(60, 255, (4, 4, 3)).astype(np.uint8)
        write_scene(
            tmp_path, shapes=shapes, variables=variables, max_depth=max_depth, image=picture
        )
        arguments = {"direct": "traced", "buffer_samples": 1, "patch_size": 8} | arguments
        return MitsubaRenderer(scene=read_scene(tmp_path), backend=backend, **arguments)

    return load


def direct(renderer, v=None, resolution=RESOLUTION):
    """[n, n, 3] linear radiance."""
    v = torch.zeros(renderer.dimensions) if v is None else torch.tensor(v)
    image = renderer.image_buffers(v, resolution=resolution)
    return image[..., renderer.layout.slice("direct")].expm1().numpy()


def lit_by_the_bulb(point, normal, bulb=BULB_AT):
    """Of a diffuse surface: albedo / pi * intensity * cos / distance^2."""
    away = bulb - point
    distance = np.linalg.norm(away, axis=-1, keepdims=True)
    cosine = unit(away) @ np.asarray(normal, dtype=float)
    return ALBEDO / np.pi * INTENSITY * cosine[..., None] / distance**2


def test_a_point_light_over_a_diffuse_plane(load, backend) -> None:
    floor = on_plane(ORIGIN, rays(RESOLUTION), np.zeros(3), [0, 0, 1])
    renderer = load(FLOOR + BULB, backend=backend)
    np.testing.assert_allclose(direct(renderer), lit_by_the_bulb(floor, [0, 0, 1]), rtol=1e-4)
    np.testing.assert_allclose(direct(renderer, [1.0]), 2 * direct(renderer), rtol=1e-4)


def test_what_stands_in_the_light_shades(load, backend) -> None:
    plate = '<scale value="3"/><translate z="1.5"/><translate x="5"/>'
    lit = direct(load(FLOOR + BULB, backend=backend))
    shaded = direct(load(FLOOR + BULB + rectangle("plate", plate, BLACK), backend=backend))
    assert (shaded <= lit).all()
    np.testing.assert_array_equal(shaded, lit)  # the plate begins at x = 2
    plate = plate.replace('x="5"', 'x="3.45"')  # at 0.45: the bulb's light to the right half
    shaded = direct(load(FLOOR + BULB + rectangle("plate", plate, BLACK), backend=backend))
    floor = on_plane(ORIGIN, rays(RESOLUTION), np.zeros(3), [0, 0, 1])
    crossing = floor + (BULB_AT - floor) * 0.75
    dark = crossing[..., 0] > 0.45
    seen = (floor + (ORIGIN - floor) * 0.375)[..., 0] < 0.45  # the plate does not hide it
    assert (dark & seen).any()
    assert (shaded[dark & seen] == 0).all()
    np.testing.assert_allclose(shaded[~dark & seen], lit[~dark & seen], rtol=1e-5)


def test_a_spherical_light_over_a_diffuse_plane(load, backend) -> None:
    """Irradiance pi L (R / d)^2 cos, exact where the sphere is above the horizon."""
    floor = on_plane(ORIGIN, rays(RESOLUTION), np.zeros(3), [0, 0, 1])
    away = np.array([1.5, 0, 1]) - floor
    squared = (away**2).sum(-1, keepdims=True)
    expected = ALBEDO * INTENSITY * 0.3**2 / squared * unit(away)[..., 2:]
    samples = 64 if backend == "llvm" else 4
    found = direct(load(FLOOR + GLOBE, backend=backend, variables=[PAINT.replace("[0, 0, 0]",
        "[0.8, 0.5, 0.2]")], buffer_samples=samples))  # fmt: skip
    error = found / expected - 1
    assert abs(error).max() < (0.02 if backend == "llvm" else 0.2)
    assert abs(np.diff(error, axis=0)).max() < 0.03, "noise between pixels"


def test_the_sky_over_a_diffuse_plane_is_the_same_in_every_pixel(load, backend) -> None:
    renderer = load(FLOOR + SKY, backend=backend, variables=[DIM.replace("bulb", "sky")])
    image = direct(renderer)
    assert image.std(axis=(0, 1)).max() < 1e-4
    samples = 256 if backend == "llvm" else 16
    image = direct(
        load(
            FLOOR + SKY,
            backend=backend,
            variables=[DIM.replace("bulb", "sky")],
            buffer_samples=samples,
        ),
        resolution=2,
    )
    np.testing.assert_allclose(image.mean((0, 1)), ALBEDO * [0.5, 1, 2], rtol=1.0 / samples**0.5)


def test_a_mirror_shows_the_sky_after_one_bounce(load, backend) -> None:
    shapes = rectangle("mirror", '<scale value="4"/>', MIRROR) + SKY
    renderer = load(shapes, backend=backend, variables=[DIM.replace("bulb", "sky")])
    expected = np.broadcast_to(REFLECTANCE * [0.5, 1, 2], (RESOLUTION, RESOLUTION, 3))
    np.testing.assert_allclose(direct(renderer), expected, rtol=1e-4)


@pytest.mark.parametrize(("max_depth", "lit"), [(3, True), (2, False)])
def test_at_the_end_of_a_chain_the_throughput_counts(load, backend, max_depth, lit) -> None:
    """A mirror at z = 0 shows the wall at z = 6, behind the camera; the bulb lights that."""
    wall = rectangle("wall", '<scale value="4"/><rotate x="1" angle="180"/>'
        '<translate z="6"/>', DIFFUSE)  # fmt: skip
    shapes = rectangle("mirror", '<scale value="4"/>', MIRROR) + wall + BULB
    d = rays(RESOLUTION)
    mirrored = on_plane(ORIGIN * [1, 1, -1], d * [1, 1, -1], np.array([0, 0, 6.0]), [0, 0, -1])
    expected = REFLECTANCE * lit_by_the_bulb(mirrored, [0, 0, -1])
    renderer = load(shapes, backend=backend, specular="traced", max_depth=max_depth)
    np.testing.assert_allclose(direct(renderer), expected if lit else 0 * expected, rtol=1e-3)
    assert (direct(load(shapes, backend=backend, max_depth=max_depth)) == 0).all(), "first hit"


def test_it_depends_on_no_seed_and_patches_show_the_image(load, backend) -> None:
    shapes = FLOOR + GLOBE + rectangle(
        "screen", '<translate z="-1"/>', '<emitter type="area"><texture type="bitmap" '
        'name="radiance"><string name="filename" value="picture.png"/></texture></emitter>'
    )  # fmt: skip
    moves = "{object: floor, property: translation, minimum: [0, 0, 0], maximum: [0, 0, 0.5]}"
    renderer = load(shapes, backend=backend, variables=[moves, PAINT], buffer_samples=2)
    first = assert_seedless(renderer)
    assert first[..., renderer.layout.slice("direct")].std() > 0.01


def test_every_other_buffer_and_the_radiance_stay_as_they_are(load_box, backend) -> None:
    learned, traced = (
        load_box(backend, patch_size=8, buffer_samples=1, **options)
        for options in ({}, {"direct": "traced"})
    )
    assert traced.layout.names == (*learned.layout.names[:-1], "direct", "emission")
    assert traced.scene_hash == learned.scene_hash
    states = torch.rand(2, 12, generator=torch.Generator().manual_seed(0))
    a, b = (r.render_patches(states, resolution=32, seed=0) for r in (learned, traced))
    assert torch.equal(a.log_radiance, b.log_radiance)
    for name in learned.layout.names:
        old, new = learned.layout.slice(name), traced.layout.slice(name)
        assert torch.equal(a.buffers[..., old], b.buffers[..., new])
    assert (b.buffers[..., traced.layout.slice("direct")] > 0).any()


def test_backends_agree(box_folder) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    v = torch.rand(10, generator=torch.Generator().manual_seed(0))
    a, b = (
        direct(
            MitsubaRenderer(
                scene=read_scene(box_folder), backend=name, buffer_samples=2, direct="traced"
            ),
            v.tolist(),
        )
        for name in ("llvm", "scalar")
    )
    different = (abs(a - b) > 1e-3 + 1e-3 * b).any(-1)
    assert different.mean() < 0.03  # rays that meet an edge


LEFT_OUT = {
    "nothing emits": (FLOOR, 5),
    "paths end at the first surface": (FLOOR + BULB, 1),
    "there is no surface": (SKY, 5),
    "an emitter that no path meets": (
        FLOOR + GLOBE.replace('type="area"', 'type="directionalarea"'),
        5,
    ),
}


@pytest.mark.parametrize("why", LEFT_OUT)
def test_a_scene_without_direct_light_carries_none(load, why) -> None:
    shapes, max_depth = LEFT_OUT[why]
    moves = DIM.replace("bulb", "sky") if shapes == SKY else PAINT
    options = {"backend": "scalar", "max_depth": max_depth, "variables": [moves]}
    assert "direct" not in load(shapes, **options).layout.names
    everything = load(shapes, needed_only=False, **options)
    assert "direct" in everything.layout.names
    assert (direct(everything, resolution=2) == 0).all()


def test_light_that_changes_out_of_view_changes_the_direct_light(load, backend) -> None:
    learned, traced = (
        load(FLOOR + BULB, backend=backend, direct=choice) for choice in ("learned", "traced")
    )
    states = torch.tensor([[0.0, 0.5, 0.5], [1.0, 0.5, 0.5]])
    a, b = (r.render_patches(states, resolution=16, seed=0).buffers for r in (learned, traced))
    assert torch.equal(a[0], a[1])
    light = b[..., traced.layout.slice("direct")].expm1()
    torch.testing.assert_close(light[1], 2 * light[0])


def test_sixteen_points_are_spread_evenly_in_each_pair_used_together() -> None:
    points = np.concatenate([subpixel_points(16), light_points(16)[:, :5]], axis=1)
    assert ((points > 0) & (points < 1)).all()
    together = [(0, 1), (3, 4), (5, 6), *((0, i) for i in range(2, 7))]
    for pair in together:
        for k in range(5):
            cells = np.floor(points[:, pair] * [2**k, 2 ** (4 - k)])
            assert len(np.unique(cells, axis=0)) == 16, (pair, k)
    assert light_points(1).tolist() == [[0.5] * 5 + [1.0]]
    assert len(np.unique(light_points(5), axis=0)) == 5


@pytest.mark.parametrize("count", [5, 8, 16, 64])
@pytest.mark.parametrize(
    "emitters", [[1, 1, 1], [12, 2.5, 0.3, 0.3, 8], [1, 0, 3, 1], [1, 1, 1, 1, 1], [0.001, 1]]
)
def test_whatever_the_number_of_points_each_emitter_is_as_bright(count, emitters) -> None:
    """The weighted mean over the points of 1 / probability, as a sample's light is divided."""
    probability = np.array(emitters) / np.sum(emitters)
    ends = np.cumsum(probability)
    points = light_points(count, probability)
    assert ((points[:, :5] > 0) & (points[:, :5] < 1)).all()
    chosen = np.searchsorted(ends, points[:, 1])
    light = points[:, 5] / probability[chosen] / count
    found = np.bincount(chosen, light, minlength=len(emitters))
    np.testing.assert_allclose(found, probability > 0, rtol=1e-12)
    within = (points[:, 1] - (ends - probability)[chosen]) / probability[chosen]
    for emitter in np.unique(chosen):
        spread = np.sort(within[chosen == emitter])
        np.testing.assert_allclose(spread, (np.arange(len(spread)) + 0.5) / len(spread), atol=1e-9)


def test_emitters_of_one_probability_each_have_the_points_that_they_had() -> None:
    for equal in (1, 2, 4, 8):
        points = light_points(16, np.full(equal, 1 / equal))
        assert np.array_equal(points[:, :5], light_points(16)[:, :5])
        assert (points[:, 5] == 1).all()


def test_lamps_that_are_seldom_chosen_light_the_floor_as_the_others_do(load, backend) -> None:
    """Of 16 rays none took the seldom one, and the light of others was rounded to sixteenths."""
    seldom = BULB.replace("</emitter>", '<float name="sampling_weight" value="0.02"/></emitter>')
    green = BULB.replace("bulb", "green").replace("0.5, 0.2, 2", "-0.5, 0.2, 2")
    both = load(FLOOR + seldom + green, backend=backend, buffer_samples=16)
    found = direct(both)
    alone = direct(load(FLOOR + BULB, backend=backend, buffer_samples=16))
    other = direct(
        load(
            FLOOR + green,
            backend=backend,
            buffer_samples=16,
            variables=("{object: green, property: intensity, minimum: 1, maximum: 2}",),
        )
    )
    np.testing.assert_allclose(found, alone + other, rtol=0.03)  # each at other places of a pixel


@pytest.mark.parametrize("samples", [None, 1])
def test_every_emitter_has_a_ray_however_few_are_asked_for(load, backend, samples) -> None:
    """As glimpses and previews ask: of four rays and five lamps one is dark everywhere."""
    bulb = BULB.replace("bulb", "bulb{}").replace('value="6, 4, 2"', 'value="1, 1, 1"')
    lamps = BULB + "".join(bulb.format(number) for number in range(4))
    renderer = load(FLOOR + lamps, backend=backend, buffer_samples=2)
    assert renderer.buffer_samples == 5
    pixels = torch.tensor([0, 37, RESOLUTION**2 - 1])
    found = renderer.pixel_buffers(
        torch.zeros(1), pixels, resolution=RESOLUTION, samples=samples, caustics=False
    )
    whole = renderer.image_buffers(torch.zeros(1), resolution=RESOLUTION, samples=samples)
    torch.testing.assert_close(found, whole.flatten(0, 1)[pixels].cpu(), rtol=1e-5, atol=1e-6)
    light = found[:, renderer.layout.slice("direct")].expm1().numpy()
    floor = on_plane(ORIGIN, rays(RESOLUTION), np.zeros(3), [0, 0, 1])
    expected = lit_by_the_bulb(floor, [0, 0, 1]) * (1 + 4 / INTENSITY)
    np.testing.assert_allclose(light, expected.reshape(-1, 3)[pixels], rtol=0.05)  # as above


def test_a_thousand_emitters_do_not_ask_for_a_thousand_rays(load, backend, monkeypatch) -> None:
    monkeypatch.setattr("ngi.render.direct_light.MOST_RAYS", 3)
    bulb = BULB.replace("bulb", "bulb{}")
    lamps = BULB + "".join(bulb.format(number) for number in range(4))
    assert load(FLOOR + lamps, backend=backend, buffer_samples=2).buffer_samples == 3


def test_other_words_are_refused(load) -> None:
    with pytest.raises(ValueError, match=r"renderer\.direct 'foo': choose one of learned, "):
        load(FLOOR + BULB, backend="scalar", direct="foo")


def test_layout_and_the_analytic_renderer() -> None:
    layout = BufferLayout().adding(["direct", "throughput"])
    assert layout.names[-3:] == ("throughput", "direct", "emission")
    assert layout.input_channels == BufferLayout().input_channels + 6
    renderer = AnalyticRenderer(dimensions=1, patch_size=4, layout=layout)
    image = renderer.image_buffers(torch.zeros(1), resolution=4).expm1()
    known = image[..., layout.slice("direct")] + image[..., layout.slice("emission")]
    ambient = renderer.render_image(torch.zeros(1), resolution=4, samples_per_pixel=1, seed=0)
    torch.testing.assert_close(ambient - known, torch.full_like(known, 0.1), atol=1e-5, rtol=0)


def test_the_program_trains_on_it(tmp_path) -> None:
    buffers = stored_buffers(tmp_path, "scene=sphere-caustic", "renderer.direct=traced")
    assert buffers[-2:] == ["direct", "emission"]
