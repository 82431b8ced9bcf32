"""Which surfaces are followed as specular ones, and at which roughness."""

import numpy as np
import pytest
import torch

from ngi.machine.backend import llvm_problem
from tests.render.optics import (
    ORIGIN,
    fresnel,
    on_plane,
    rays,
    rectangle,
)
from tests.render.specular_scenes import (
    BACK,
    GLASS,
    INDEX,
    MIRROR_NORMAL,
    PLATE,
    RESOLUTION,
    ROUGH,
    SIDE,
    SKY,
    STEEL,
    TILTED,
    buffers,
    mirror,
    slab,
)


def test_a_variable_roughness_decides_at_every_v(load_specular, backend) -> None:
    steel = ROUGH.format(alpha='<float name="alpha" value="0.3"/>')
    shapes = BACK + SIDE + SKY + rectangle("mirror", TILTED, steel)
    renderer = load_specular(shapes, backend=backend, variables=[STEEL])
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


def test_a_textured_roughness_decides_ray_by_ray(load_specular, backend) -> None:
    alpha = '<texture type="checkerboard" name="alpha"><rgb name="color0" value="0.02"/>\
<rgb name="color1" value="0.3"/></texture>'
    steel = ROUGH.format(alpha=alpha)
    seen = buffers(
        load_specular(BACK + SIDE + SKY + rectangle("mirror", TILTED, steel), backend=backend)
    )
    _, _, _, met = mirror()
    smooth = np.isclose(seen["chain_roughness"][met], 0.02, rtol=1e-4)
    assert 0.3 < smooth.mean() < 0.7
    np.testing.assert_allclose(seen["roughness"][met][~smooth], 0.3, rtol=1e-4)
    np.testing.assert_allclose(seen["roughness"][met][smooth], 1)


def test_what_a_rough_mirror_shows_of_emitters_is_direct_light(load_specular, backend) -> None:
    """Where a network can dim it: a rough surface blurs a lamp, which the buffers do not."""
    steel = ROUGH.format(alpha='<float name="alpha" value="0.03"/>')
    shapes = BACK + SIDE + SKY + rectangle("mirror", TILTED, steel)
    known, seen = (
        buffers(load_specular(shapes, backend=backend, buffer_samples=4, direct=direct))
        for direct in ("learned", "traced")
    )
    _, _, _, met = mirror()
    assert known["emission"][met].min() > 0.05
    assert (seen["emission"][met] == 0).all()
    np.testing.assert_allclose(seen["direct"][met], known["emission"][met], rtol=1e-5)
    beside = (known["chain_roughness"] == 0)[..., 0]
    assert (seen["direct"][beside] == 0).all()
    np.testing.assert_array_equal(seen["emission"][beside], known["emission"][beside])


def test_what_the_other_branch_of_rough_glass_shows_is_direct_light_too(load_specular) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    alpha = '<float name="alpha" value="0.03"/></bsdf>'
    rough = GLASS.replace('"dielectric"', '"roughdielectric"').replace("</bsdf>", alpha)
    sharp, blurred = (
        buffers(load_specular(BACK + SKY + plate, backend="llvm", direct="traced"))
        for plate in (PLATE, PLATE.replace(GLASS, rough))
    )
    _, _, _, met = slab()
    assert (sharp["direct"][met] == 0).all()
    assert (blurred["emission"][met] == 0).all()
    np.testing.assert_allclose(blurred["direct"][met], sharp["emission"][met], rtol=1e-4)


def test_roughness_of_a_chain_adds_in_squares(load_specular, backend) -> None:
    glass = GLASS.replace('"dielectric"', '"roughdielectric"').replace(
        "</bsdf>", '<float name="alpha" value="0.03"/></bsdf>'
    )
    seen = buffers(load_specular(BACK + PLATE.replace(GLASS, glass), backend=backend))
    end, _, throughput, met = slab()
    np.testing.assert_allclose(seen["chain_roughness"][met], 0.03 * np.sqrt(2), rtol=1e-4)
    np.testing.assert_allclose(seen["position"][met], end[met], atol=2e-3)
    np.testing.assert_allclose(seen["throughput"][met], throughput[met], atol=1e-4)


def test_thin_glass_passes_straight(load_specular, backend) -> None:
    pane = GLASS.replace('"dielectric"', '"thindielectric"')
    seen = buffers(
        load_specular(BACK + rectangle("pane", '<scale value="2"/>', pane), backend=backend)
    )
    d = rays(RESOLUTION)
    end = on_plane(ORIGIN, d, np.array([0, 0, -3.0]), [0, 0, 1])
    np.testing.assert_allclose(seen["position"], end, atol=1e-3)
    share = fresnel(-d[..., 2:], INDEX)
    expected = np.broadcast_to(1 - 2 * share / (1 + share), d.shape)
    np.testing.assert_allclose(seen["throughput"], expected, atol=1e-4)


def test_a_variable_index_of_thin_glass(load_specular, backend) -> None:
    pane = GLASS.replace('"dielectric"', '"thindielectric"')
    shapes = BACK + rectangle("pane", '<scale value="2"/>', pane)
    variable = "{object: glass, property: eta, minimum: 1.2, maximum: 2.2}"
    renderer = load_specular(shapes, backend=backend, variables=[variable])
    d = rays(RESOLUTION)
    for v in (0.0, 0.3, 1.0):
        share = fresnel(-d[..., 2:], 1.2 + v)
        expected = np.broadcast_to(1 - 2 * share / (1 + share), d.shape)
        np.testing.assert_allclose(buffers(renderer, [v])["throughput"], expected, atol=1e-4)


@pytest.mark.parametrize("two_sided", [True, False])
def test_a_conductor_from_behind(load_specular, backend, two_sided) -> None:
    plain = '<bsdf type="conductor"><rgb name="specular_reflectance" value="0.8"/></bsdf>'
    bsdf = f'<bsdf type="twosided">{plain}</bsdf>' if two_sided else plain
    turned = '<scale value="1.2"/><rotate y="1" angle="225"/>'
    seen = buffers(
        load_specular(BACK + SIDE + SKY + rectangle("mirror", turned, bsdf), backend=backend)
    )
    end, _, _, met = mirror()
    if not two_sided:
        end = on_plane(ORIGIN, rays(RESOLUTION), np.zeros(3), MIRROR_NORMAL)
    np.testing.assert_allclose(seen["position"][met], end[met], atol=2e-3)
    np.testing.assert_allclose(seen["throughput"][met], 0.8 if two_sided else 1, rtol=1e-5)


@pytest.mark.parametrize(("alpha", "buffers_more"), [("0.5", False), ("0.001", True), ("0", True)])
def test_of_two_sides_the_front_decides(load_specular, backend, alpha, buffers_more) -> None:
    kind = "conductor" if alpha == "0" else "roughconductor"
    rough = "" if alpha == "0" else f'<float name="alpha" value="{alpha}"/>'
    sides = f'<bsdf type="{kind}">{rough}</bsdf><bsdf type="diffuse"/>'
    mirror = rectangle("mirror", TILTED, f'<bsdf type="twosided">{sides}</bsdf>')
    names = load_specular(BACK + SIDE + SKY + mirror, backend=backend).layout.names
    assert ("throughput" in names) == buffers_more
    assert ("chain_roughness" in names) == (alpha == "0.001")


def test_a_mapped_mirror_is_not_followed(load_specular, backend) -> None:
    bumps = '<bsdf type="bumpmap"><texture type="bitmap" name="arbitrary">\
<string name="filename" value="picture.png"/></texture>{}</bsdf>'
    shapes = BACK + rectangle("mirror", TILTED, bumps.format('<bsdf type="conductor"/>'))
    assert "throughput" not in load_specular(shapes, backend=backend).layout.names


def test_a_scene_without_specular_surfaces_is_the_same_as_learned(load_box, backend) -> None:
    """The box: its metal varies from alpha = 0.1 up, and plastic is not followed."""
    learned, traced = (
        load_box(backend, patch_size=8, buffer_samples=1, specular=specular)
        for specular in ("learned", "traced")
    )
    assert traced.layout == learned.layout
    assert traced.scene_hash == learned.scene_hash
    states = torch.rand(2, 12, generator=torch.Generator().manual_seed(0))
    a, b = (r.render_patches(states, resolution=32, seed=0) for r in (learned, traced))
    assert torch.equal(a.buffers, b.buffers)
    assert torch.equal(a.log_radiance, b.log_radiance)
