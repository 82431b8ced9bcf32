"""Where chains of specular bounces end and what they carry, by reflection, Snell and Fresnel."""

import numpy as np
import pytest
import torch

from ngi.machine.backend import llvm_problem
from tests.render.optics import (
    ORIGIN,
    dot,
    fresnel,
    on_plane,
    on_unit_sphere,
    rays,
    rectangle,
    reflected,
    refracted,
)
from tests.render.specular_scenes import (
    BACK,
    BRIGHTEST,
    GLASS,
    INDEX,
    PICTURE,
    PLAIN,
    PLATE,
    RESOLUTION,
    SCENES,
    SKY,
    buffers,
    mirror,
    mirror_and_slab,
    slab,
    sphere,
)


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
def test_end_of_the_chain(load_specular, backend, name, truth, fov) -> None:
    end, away, throughput, met = truth()
    assert met.mean() > 0.4
    seen = buffers(load_specular(SCENES[name], backend=backend, fov=fov))
    # Mitsuba moves a ray's start off the surface, which tells where it meets a sphere at grazing.
    loose = 10 if truth is sphere else 1
    np.testing.assert_allclose(seen["position"][met], end[met], atol=2e-3 * loose)
    np.testing.assert_allclose(seen["outgoing"][met], -away[met], atol=2e-4 * loose)
    np.testing.assert_allclose(seen["throughput"][met], throughput[met], atol=2e-4 * loose)
    normal = [0, 0, 1] if truth in (slab, sphere) else [-1, 0, 0]
    np.testing.assert_allclose(seen["normal"][met] * 2 - 1, [normal] * met.sum(), atol=1e-5)
    assert "chain_roughness" not in seen


def test_where_nothing_specular_is_met_the_buffers_are_the_first_hits(
    load_specular, backend
) -> None:
    traced = buffers(load_specular(SCENES["sphere"], backend=backend, fov=32))
    learned = buffers(load_specular(SCENES["sphere"], backend=backend, fov=32, specular="learned"))
    beside = np.isnan(on_unit_sphere(ORIGIN, rays(RESOLUTION, fov=32), leaving=False)).all(-1)
    assert beside.mean() > 0.05
    assert "throughput" not in learned
    for name in learned:
        np.testing.assert_array_equal(traced[name][beside], learned[name][beside])
    np.testing.assert_array_equal(traced["throughput"][beside], 1)


@pytest.mark.parametrize("name", SCENES)
def test_emission_is_the_path_traced_radiance_but_for_the_branches_not_taken(
    load_specular, name
) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    fov = 32 if name == "sphere" else 20
    renderer = load_specular(SCENES[name], backend="llvm", fov=fov, buffer_samples=1024)
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


def test_a_pane_mirrors_the_sky_beside_what_it_lets_through(load_specular, backend) -> None:
    pane = GLASS.replace('"dielectric"', '"thindielectric"')
    shapes = BACK.replace(PICTURE, PLAIN) + SKY + rectangle("pane", '<scale value="2"/>', pane)
    share = fresnel(-rays(RESOLUTION)[..., 2:], INDEX)
    mirrored = np.broadcast_to(2 * share / (1 + share), (RESOLUTION, RESOLUTION, 3))
    for direct, seen_of_sky in (("traced", 0.3), ("learned", 0.0)):
        emission = buffers(load_specular(shapes, backend=backend, direct=direct))["emission"]
        expected = 0.5 * (1 - mirrored) + seen_of_sky * mirrored
        np.testing.assert_allclose(np.expm1(emission), expected, atol=1e-4)


def test_what_a_mirror_shows_of_a_pane_has_passed_both(load_specular, backend) -> None:
    to_world = '<scale value="3"/><rotate y="1" angle="-60"/><translate x="2"/>'
    pane = rectangle("pane", to_world, GLASS.replace('"dielectric"', '"thindielectric"'))
    shapes = SCENES["mirror"].replace(PICTURE, PLAIN) + pane
    _, away, throughput, met = mirror()
    share = fresnel(-dot(away, np.array([-np.sqrt(0.75), 0, 0.5])), INDEX)
    mirrored = 2 * share / (1 + share)
    seen = buffers(load_specular(shapes, backend=backend, direct="traced"))
    expected = throughput * (0.5 * (1 - mirrored) + 0.3 * mirrored)
    np.testing.assert_allclose(np.expm1(seen["emission"])[met], expected[met], atol=1e-4)


def test_with_highlights_all_that_two_bounces_show_of_emitters_is_there(load_specular) -> None:
    """Longer paths than to the sky by one bounce or to the wall by two Mitsuba does not trace."""
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    arguments = {"backend": "llvm", "max_depth": 3, "buffer_samples": 1024}
    radiance, found = None, []
    for direct in ("traced", "learned"):
        renderer = load_specular(BACK + SKY + PLATE, direct=direct, **arguments)
        if radiance is None:
            radiance = renderer.render_image(
                torch.zeros(3), resolution=12, samples_per_pixel=2**14, seed=0
            ).numpy()
        found.append(np.expm1(buffers(renderer, resolution=12)["emission"]))
    np.testing.assert_allclose(found[0], radiance, atol=0.012)
    assert (radiance - found[1]).mean() > 0.01


def test_total_internal_reflection(load_specular, backend) -> None:
    """A bar of glass: rays that enter its front are reflected by its side and leave by its end."""
    bar = f'<shape type="cube"><transform name="to_world"><scale x="0.3" y="2" z="1"/>\
<translate z="-1"/><rotate y="1" angle="20"/></transform>{GLASS}</shape>'
    seen = buffers(load_specular(BACK + bar, backend=backend))
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


@pytest.mark.parametrize(("max_depth", "bounces"), [(4, 3), (40, 12), (-1, 12)])
def test_no_chain_is_longer_than_the_paths(load_specular, backend, max_depth, bounces) -> None:
    """Two mirrors that face each other; the camera stands between them."""
    plain = '<bsdf type="conductor"><rgb name="specular_reflectance" value="0.8"/></bsdf>'
    pair = rectangle("front", '<scale value="4"/>', plain)
    pair += rectangle(
        "rear", '<scale value="4"/><rotate y="1" angle="180"/><translate z="4.5"/>', plain
    )
    painted = pair + BACK
    seen = buffers(load_specular(painted, backend=backend, max_depth=max_depth, fov=2))
    np.testing.assert_allclose(seen["throughput"], 0.8**bounces, rtol=1e-4)
    z = 0 if bounces % 2 == 0 else 4.5
    np.testing.assert_allclose(seen["position"][..., 2], z, atol=1e-3)
    assert (seen["roughness"] == 0).all()
