"""Traced specular bounces against reflection, Snell's law and Fresnel's equations in NumPy."""

import numpy as np
import pandas as pd
import pytest
import torch

from ngi.machine.backend import llvm_problem
from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene
from ngi.studies.benchmark.measure import counted_compilations
from tests.learn.command_line import SMALL, run
from tests.render.optics import (
    ORIGIN,
    SIZE,
    dot,
    fresnel,
    on_plane,
    on_unit_sphere,
    rays,
    rectangle,
    reflected,
    refracted,
    write_scene,
)
from tests.render.specular_scenes import (
    BACK,
    BALL,
    BRIGHTEST,
    COLOURS,
    GLASS,
    INDEX,
    MIRROR_NORMAL,
    PAINT,
    PICTURE,
    PLAIN,
    PLATE,
    RESOLUTION,
    SCENES,
    SIDE,
    SKY,
    TILTED,
    mirror,
    mirror_and_slab,
    slab,
    sphere,
)


@pytest.fixture(params=["llvm", "scalar"])
def backend(request):
    if request.param == "llvm" and (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    return request.param


@pytest.fixture
def load(tmp_path):
    def load(shapes, *, backend, variables=(PAINT,), max_depth=10, fov=20, **arguments):
        write_scene(
            tmp_path,
            shapes=shapes,
            variables=variables,
            max_depth=max_depth,
            fov=fov,
            image=COLOURS,
        )
        arguments = {"specular": "traced", "buffer_samples": 1, "patch_size": 8} | arguments
        return MitsubaRenderer(scene=read_scene(tmp_path), backend=backend, **arguments)

    return load


def buffers(renderer, v=None, resolution=RESOLUTION):
    """Name -> [n, n, channels], positions in the scene's units."""
    v = torch.zeros(renderer.dimensions) if v is None else torch.tensor(v)
    image = renderer.image_buffers(v, resolution=resolution).numpy()
    named = {name: image[..., renderer.layout.slice(name)] for name in renderer.layout.names}
    return named | {"position": (2 * named["position"] - 1) * SIZE}


@pytest.mark.parametrize(
    ("name", "truth", "fov"),
    [
        ("mirror", mirror, 20),
        ("glowing mirror", mirror, 20),
        ("slab", slab, 20),
        ("sphere", sphere, 32),
        ("mirror and slab", mirror_and_slab, 20),
    ],
)
def test_end_of_the_chain(load, backend, name, truth, fov) -> None:
    end, away, throughput, met = truth()
    assert met.mean() > 0.4
    seen = buffers(load(SCENES[name], backend=backend, fov=fov))
    # Mitsuba moves a ray's start off the surface, which tells where it meets a sphere at grazing.
    loose = 10 if truth is sphere else 1
    np.testing.assert_allclose(seen["position"][met], end[met], atol=2e-3 * loose)
    np.testing.assert_allclose(seen["outgoing"][met], -away[met], atol=2e-4 * loose)
    np.testing.assert_allclose(seen["throughput"][met], throughput[met], atol=2e-4 * loose)
    normal = [0, 0, 1] if truth in (slab, sphere) else [-1, 0, 0]
    np.testing.assert_allclose(seen["normal"][met] * 2 - 1, [normal] * met.sum(), atol=1e-5)
    assert "chain_roughness" not in seen


def test_where_nothing_specular_is_met_the_buffers_are_the_first_hits(load, backend) -> None:
    traced = buffers(load(SCENES["sphere"], backend=backend, fov=32))
    learned = buffers(load(SCENES["sphere"], backend=backend, fov=32, specular="learned"))
    beside = np.isnan(on_unit_sphere(ORIGIN, rays(RESOLUTION, fov=32), leaving=False)).all(-1)
    assert beside.mean() > 0.05
    assert "throughput" not in learned
    for name in learned:
        np.testing.assert_array_equal(traced[name][beside], learned[name][beside])
    np.testing.assert_array_equal(traced["throughput"][beside], 1)


@pytest.mark.parametrize("name", SCENES)
def test_emission_is_the_path_traced_radiance_but_for_the_branches_not_taken(load, name) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    fov = 32 if name == "sphere" else 20
    renderer = load(SCENES[name], backend="llvm", fov=fov, buffer_samples=1024)
    v = torch.zeros(3)
    renderings = torch.stack(
        [
            renderer.render_image(v, resolution=12, samples_per_pixel=1024, seed=seed)
            for seed in range(16)
        ]
    )
    radiance, noise = renderings.mean(0).numpy(), (renderings.std(0) / 4).numpy()
    seen = buffers(renderer, resolution=12)
    emission = np.expm1(seen["emission"])
    margin = 5 * noise + 4e-3  # pixels that an edge crosses are sampled differently
    branches = "slab" in name or name == "sphere"
    missing = (1 - seen["throughput"]) * BRIGHTEST if branches else 0
    assert (radiance > emission - margin).all()
    assert (radiance < emission + missing + margin).all()
    assert radiance.std() > 0.05


def test_a_pane_mirrors_the_sky_beside_what_it_lets_through(load, backend) -> None:
    pane = GLASS.replace('"dielectric"', '"thindielectric"')
    shapes = BACK.replace(PICTURE, PLAIN) + SKY + rectangle("pane", '<scale value="2"/>', pane)
    share = fresnel(-rays(RESOLUTION)[..., 2:], INDEX)
    mirrored = np.broadcast_to(2 * share / (1 + share), (RESOLUTION, RESOLUTION, 3))
    for direct, seen_of_sky in (("traced", 0.3), ("learned", 0.0)):
        emission = buffers(load(shapes, backend=backend, direct=direct))["emission"]
        expected = 0.5 * (1 - mirrored) + seen_of_sky * mirrored
        np.testing.assert_allclose(np.expm1(emission), expected, atol=1e-4)


def test_what_a_mirror_shows_of_a_pane_has_passed_both(load, backend) -> None:
    to_world = '<scale value="3"/><rotate y="1" angle="-60"/><translate x="2"/>'
    pane = rectangle("pane", to_world, GLASS.replace('"dielectric"', '"thindielectric"'))
    shapes = SCENES["mirror"].replace(PICTURE, PLAIN) + pane
    _, away, throughput, met = mirror()
    share = fresnel(-dot(away, np.array([-np.sqrt(0.75), 0, 0.5])), INDEX)
    mirrored = 2 * share / (1 + share)
    seen = buffers(load(shapes, backend=backend, direct="traced"))
    expected = throughput * (0.5 * (1 - mirrored) + 0.3 * mirrored)
    np.testing.assert_allclose(np.expm1(seen["emission"])[met], expected[met], atol=1e-4)


def test_with_highlights_all_that_two_bounces_show_of_emitters_is_there(load) -> None:
    """Longer paths than to the sky by one bounce or to the wall by two Mitsuba does not trace."""
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    arguments = {"backend": "llvm", "max_depth": 3, "buffer_samples": 1024}
    radiance, found = None, []
    for direct in ("traced", "learned"):
        renderer = load(BACK + SKY + PLATE, direct=direct, **arguments)
        if radiance is None:
            radiance = renderer.render_image(
                torch.zeros(3), resolution=12, samples_per_pixel=2**14, seed=0
            ).numpy()
        found.append(np.expm1(buffers(renderer, resolution=12)["emission"]))
    np.testing.assert_allclose(found[0], radiance, atol=0.012)
    assert (radiance - found[1]).mean() > 0.01


def test_total_internal_reflection(load, backend) -> None:
    """A bar of glass: rays that enter its front are reflected by its side and leave by its end."""
    bar = f'<shape type="cube"><transform name="to_world"><scale x="0.3" y="2" z="1"/>\
<translate z="-1"/><rotate y="1" angle="20"/></transform>{GLASS}</shape>'
    seen = buffers(load(BACK + bar, backend=backend))
    sine, cosine = np.sin(np.radians(20)), np.cos(np.radians(20))
    along, across = np.array([sine, 0, cosine]), np.array([cosine, 0, -sine])
    d = rays(RESOLUTION)
    enter = on_plane(ORIGIN, d, np.zeros(3), along)
    inside = refracted(d, along, INDEX)
    side = on_plane(enter, inside, 0.3 * across, across)
    mirrored = reflected(inside, across)
    leave = on_plane(side, mirrored, -2 * along, along)
    away = refracted(mirrored, along, 1 / INDEX)
    end = on_plane(leave, away, np.array([0, 0, -3.0]), [0, 0, 1])
    met = (abs(enter @ across) < 0.29) & (side @ along > -1.99) & (abs(leave @ across) < 0.29)
    met &= (abs(end[..., :2]) < 4).all(-1)
    assert met.sum() > 20
    np.testing.assert_allclose(seen["position"][met], end[met], atol=3e-3)
    passed = (1 - fresnel(-dot(d, along), INDEX)) ** 2
    np.testing.assert_allclose(seen["throughput"][met][:, :1], passed[met], atol=1e-4)


ROUGH = '<bsdf type="twosided" id="steel"><bsdf type="roughconductor">\
<string name="material" value="none"/>{alpha}</bsdf></bsdf>'
STEEL = "{object: steel, property: roughness, minimum: 0.01, maximum: 0.09}"


def test_a_variable_roughness_decides_at_every_v(load, backend) -> None:
    steel = ROUGH.format(alpha='<float name="alpha" value="0.3"/>')
    shapes = BACK + SIDE + SKY + rectangle("mirror", TILTED, steel)
    renderer = load(shapes, backend=backend, variables=[STEEL])
    end, _, _, met = mirror()
    for v, alpha in ((0.0, 0.01), (0.45, 0.046)):
        seen = buffers(renderer, [v])
        np.testing.assert_allclose(seen["chain_roughness"][met], alpha, rtol=1e-4)
        np.testing.assert_allclose(seen["throughput"][met], 1, rtol=1e-5)
        np.testing.assert_allclose(seen["position"][met], end[met], atol=2e-3)
        assert (seen["roughness"][met] == 1).all()
    seen = buffers(renderer, [0.55])
    first = on_plane(ORIGIN, rays(RESOLUTION), np.zeros(3), MIRROR_NORMAL)
    np.testing.assert_allclose(seen["position"][met], first[met], atol=1e-3)
    np.testing.assert_allclose(seen["roughness"][met], 0.054, rtol=1e-4)
    assert (seen["chain_roughness"] == 0).all()
    assert (seen["throughput"] == 1).all()


def test_a_textured_roughness_decides_ray_by_ray(load, backend) -> None:
    alpha = '<texture type="checkerboard" name="alpha"><rgb name="color0" value="0.02"/>\
<rgb name="color1" value="0.3"/></texture>'
    steel = ROUGH.format(alpha=alpha)
    seen = buffers(load(BACK + SIDE + SKY + rectangle("mirror", TILTED, steel), backend=backend))
    _, _, _, met = mirror()
    smooth = np.isclose(seen["chain_roughness"][met], 0.02, rtol=1e-4)
    assert 0.3 < smooth.mean() < 0.7
    np.testing.assert_allclose(seen["roughness"][met][~smooth], 0.3, rtol=1e-4)
    np.testing.assert_allclose(seen["roughness"][met][smooth], 1)


def test_roughness_of_a_chain_adds_in_squares(load, backend) -> None:
    glass = GLASS.replace('"dielectric"', '"roughdielectric"').replace(
        "</bsdf>", '<float name="alpha" value="0.03"/></bsdf>'
    )
    seen = buffers(load(BACK + PLATE.replace(GLASS, glass), backend=backend))
    end, _, throughput, met = slab()
    np.testing.assert_allclose(seen["chain_roughness"][met], 0.03 * np.sqrt(2), rtol=1e-4)
    np.testing.assert_allclose(seen["position"][met], end[met], atol=2e-3)
    np.testing.assert_allclose(seen["throughput"][met], throughput[met], atol=1e-4)


def test_thin_glass_passes_straight(load, backend) -> None:
    pane = GLASS.replace('"dielectric"', '"thindielectric"')
    seen = buffers(load(BACK + rectangle("pane", '<scale value="2"/>', pane), backend=backend))
    d = rays(RESOLUTION)
    end = on_plane(ORIGIN, d, np.array([0, 0, -3.0]), [0, 0, 1])
    np.testing.assert_allclose(seen["position"], end, atol=1e-3)
    share = fresnel(-d[..., 2:], INDEX)
    expected = np.broadcast_to(1 - 2 * share / (1 + share), d.shape)
    np.testing.assert_allclose(seen["throughput"], expected, atol=1e-4)


def test_a_variable_index_of_thin_glass(load, backend) -> None:
    pane = GLASS.replace('"dielectric"', '"thindielectric"')
    shapes = BACK + rectangle("pane", '<scale value="2"/>', pane)
    variable = "{object: glass, property: eta, minimum: 1.2, maximum: 2.2}"
    renderer = load(shapes, backend=backend, variables=[variable])
    d = rays(RESOLUTION)
    for v in (0.0, 0.3, 1.0):
        share = fresnel(-d[..., 2:], 1.2 + v)
        expected = np.broadcast_to(1 - 2 * share / (1 + share), d.shape)
        np.testing.assert_allclose(buffers(renderer, [v])["throughput"], expected, atol=1e-4)


@pytest.mark.parametrize("two_sided", [True, False])
def test_a_conductor_from_behind(load, backend, two_sided) -> None:
    plain = '<bsdf type="conductor"><rgb name="specular_reflectance" value="0.8"/></bsdf>'
    bsdf = f'<bsdf type="twosided">{plain}</bsdf>' if two_sided else plain
    turned = '<scale value="1.2"/><rotate y="1" angle="225"/>'
    seen = buffers(load(BACK + SIDE + SKY + rectangle("mirror", turned, bsdf), backend=backend))
    end, _, _, met = mirror()
    if not two_sided:
        end = on_plane(ORIGIN, rays(RESOLUTION), np.zeros(3), MIRROR_NORMAL)
    np.testing.assert_allclose(seen["position"][met], end[met], atol=2e-3)
    np.testing.assert_allclose(seen["throughput"][met], 0.8 if two_sided else 1, rtol=1e-5)


@pytest.mark.parametrize(("max_depth", "bounces"), [(4, 3), (40, 12), (-1, 12)])
def test_no_chain_is_longer_than_the_paths(load, backend, max_depth, bounces) -> None:
    """Two mirrors that face each other; the camera stands between them."""
    plain = '<bsdf type="conductor"><rgb name="specular_reflectance" value="0.8"/></bsdf>'
    pair = rectangle("front", '<scale value="4"/>', plain)
    pair += rectangle(
        "rear", '<scale value="4"/><rotate y="1" angle="180"/><translate z="4.5"/>', plain
    )
    painted = pair + BACK
    seen = buffers(load(painted, backend=backend, max_depth=max_depth, fov=2))
    np.testing.assert_allclose(seen["throughput"], 0.8**bounces, rtol=1e-4)
    z = 0 if bounces % 2 == 0 else 4.5
    np.testing.assert_allclose(seen["position"][..., 2], z, atol=1e-3)
    assert (seen["roughness"] == 0).all()


def test_llvm_equals_scalar(load) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    for name in ("sphere", "mirror and slab"):
        fov = 32 if name == "sphere" else 20
        a, b = (buffers(load(SCENES[name], backend=b, fov=fov)) for b in ("llvm", "scalar"))
        assert a.keys() == b.keys()
        different = np.any([(abs(a[n] - b[n]) > 1e-2).any(-1) for n in a], axis=0)
        assert different.mean() < 0.01  # rays that meet an edge


def test_patches_show_the_same_and_nothing_is_compiled_after_warm_up(load) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    steel = ROUGH.format(alpha='<float name="alpha" value="0.3"/>')
    ball = BALL.replace("<shape", '<shape id="ball"', 1)
    shapes = BACK + SIDE + SKY + rectangle("mirror", TILTED, steel) + ball
    shapes = shapes.replace(PICTURE, PLAIN)  # a frozen function can't sample a textured emitter
    ball_moves = "{object: ball, property: translation, minimum: [0, -1, 0], maximum: [0, 1, 0]}"
    renderer = load(shapes, backend="llvm", variables=[STEEL, ball_moves])
    renderer.warm_up()
    generator = torch.Generator().manual_seed(0)
    states = [torch.rand(4, 4, generator=generator) for _ in range(20)]
    with counted_compilations() as count:
        rendered = [renderer.render_patches(s, resolution=24, seed=i) for i, s in enumerate(states)]
    assert count == [0]
    for state, patch in zip(states[-1], rendered[-1].buffers, strict=True):
        column, row = (min(int(p * 17), 16) for p in state[2:].tolist())
        image = renderer.image_buffers(state[:2], resolution=24)
        torch.testing.assert_close(
            patch, image[row : row + 8, column : column + 8], atol=1e-5, rtol=0
        )


def test_a_scene_without_specular_surfaces_is_the_same_as_learned(box_folder, backend) -> None:
    """The box: its metal varies from alpha = 0.1 up, and plastic is not followed."""
    learned, traced = (
        MitsubaRenderer(
            scene=read_scene(box_folder),
            backend=backend,
            patch_size=8,
            buffer_samples=1,
            specular=specular,
        )
        for specular in ("learned", "traced")
    )
    assert traced.layout == learned.layout
    assert traced.scene_hash == learned.scene_hash
    states = torch.rand(2, 12, generator=torch.Generator().manual_seed(0))
    a, b = (r.render_patches(states, resolution=32, seed=0) for r in (learned, traced))
    assert torch.equal(a.buffers, b.buffers)
    assert torch.equal(a.log_radiance, b.log_radiance)


def test_a_mapped_mirror_is_not_followed(load, backend) -> None:
    bumps = '<bsdf type="bumpmap"><texture type="bitmap" name="arbitrary">\
<string name="filename" value="picture.png"/></texture>{}</bsdf>'
    shapes = BACK + rectangle("mirror", TILTED, bumps.format('<bsdf type="conductor"/>'))
    assert "throughput" not in load(shapes, backend=backend).layout.names


def test_other_words_are_refused(load) -> None:
    with pytest.raises(ValueError, match="choose one of learned, traced"):
        load(SCENES["slab"], backend="scalar", specular="mirrored")


def test_layout_and_the_analytic_renderer() -> None:
    layout = BufferLayout().adding(["chain_roughness", "throughput"])
    assert layout.names[-3:] == ("throughput", "chain_roughness", "emission")
    assert layout.input_channels == BufferLayout().input_channels + 4
    renderer = AnalyticRenderer(dimensions=1, patch_size=4, layout=layout)
    image = renderer.image_buffers(torch.zeros(1), resolution=4)
    assert (image[..., layout.slice("throughput")] == 1).all()
    assert (image[..., layout.slice("chain_roughness")] == 0).all()


def test_the_program_trains_on_traced_buffers(tmp_path) -> None:
    options = (
        "scene=mirror",
        "renderer.specular=traced",
        "renderer.samples_per_pixel=2",
        "evaluation.evaluator.protocol.resolution=32",
        "run.folder=run",
    )
    small = [option for option in SMALL if option != "renderer=analytic"]
    status, output = run(tmp_path, *options, base=tuple(small))
    assert status == 0, output
    state = torch.load(tmp_path / "run" / "last.ckpt", weights_only=True)
    buffers = state["ExplorationDataModule"]["store"]["buffers"]
    assert buffers[-2:] == ["throughput", "emission"]
    losses = pd.read_csv(tmp_path / "run" / "steps.csv")
    assert len(losses) == 12
