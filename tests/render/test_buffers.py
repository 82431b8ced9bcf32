"""First-intersection buffers of the box against intersections computed here."""

import numpy as np
import pytest
import torch

RESOLUTION = 48
OFFSET = np.array([-0.4, -0.2, -0.4]) + 0.8 * np.array([0.8, 0.4, 0.3])  # of the ball
V = torch.tensor([0.2, 0.9, 0.4, 0.8, 0.4, 0.3, 0.5, 0.5, 0.25, 1.0])


def rays():
    """Camera at (0, 1, 4), looking along -z, 40 degrees, through the pixels' centres."""
    u = ((np.arange(RESOLUTION) + 0.5) / RESOLUTION - 0.5) * 2 * np.tan(np.radians(20))
    x, y = np.meshgrid(u, -u)
    direction = np.stack([x, y, -np.ones_like(x)], -1)
    return np.array([0.0, 1.0, 4.0]), direction / np.linalg.norm(direction, axis=-1, keepdims=True)


def plane(origin, direction, axis, height, inside):
    t = (height - origin[axis]) / direction[..., axis]
    p = origin + t[..., None] * direction
    return np.where((t > 0) & inside(p), t, np.inf)


def ball(origin, direction):
    m = origin - (np.array([0, 0.5, 0]) + OFFSET)
    b = direction @ m
    discriminant = b**2 - m @ m + 0.3**2
    return np.where(discriminant > 0, -b - np.sqrt(np.maximum(discriminant, 0)), np.inf)


@pytest.fixture(scope="module")
def truth():
    """Distance to each object: floor, back, left wall, ball, lamp; the figure is left out."""
    origin, d = rays()
    t = np.stack(
        [
            plane(origin, d, 1, 0, lambda p: (abs(p[..., 0]) < 1) & (abs(p[..., 2]) < 1)),
            plane(origin, d, 2, -1, lambda p: (abs(p[..., 0]) < 1) & (abs(p[..., 1] - 1) < 1)),
            plane(origin, d, 0, -1, lambda p: (abs(p[..., 2]) < 1) & (abs(p[..., 1] - 1) < 1)),
            ball(origin, d),
            plane(origin, d, 1, 1.9, lambda p: (abs(p[..., 0]) < 0.3) & (abs(p[..., 2]) < 0.3)),
        ]
    )
    nearest = np.where(np.isfinite(t.min(0)), t.argmin(0), -1)
    point = origin + np.where(nearest >= 0, t.min(0), 0)[..., None] * d
    # Nothing is compared where the figure, a cube of side 0.4, may be seen, and on the diagonals,
    # where rays meet the edges of the walls exactly.
    figure = (point[..., 0] > 0.1) & (point[..., 1] < 0.6) & (nearest != 3)
    diagonal = np.isclose(abs(d[..., 0]), abs(d[..., 1]))
    return nearest, point, d, ~figure & ~diagonal


@pytest.fixture(scope="module", params=["llvm", "scalar"])
def image(request, load_box):
    renderer = load_box(request.param, buffer_samples=1, patch_size=16, needed_only=False)
    buffers = renderer.image_buffers(V, resolution=RESOLUTION).numpy()
    return {name: buffers[..., renderer.layout.slice(name)] for name in renderer.layout.names}


def test_every_object_is_seen(truth) -> None:
    nearest, _, _, compared = truth
    assert set(np.unique(nearest[compared])) == {-1, 0, 1, 2, 3, 4}


def test_position(image, truth) -> None:
    nearest, point, _, compared = truth
    expected = np.where(nearest[..., None] >= 0, (point - [-1, 0, -1]) / 2, 0)
    np.testing.assert_allclose(image["position"][compared], expected[compared], atol=2e-4)


def test_normal(image, truth) -> None:
    nearest, point, _, compared = truth
    flat = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 0, 0], [0, -1, 0], [-1, -1, -1]])
    normal = flat[nearest].astype(float)
    on_ball = nearest == 3
    normal[on_ball] = (point[on_ball] - np.array([0, 0.5, 0]) - OFFSET) / 0.3
    np.testing.assert_allclose(image["normal"][compared], (normal / 2 + 0.5)[compared], atol=2e-3)


def test_outgoing_points_to_the_camera(image, truth) -> None:
    nearest, _, direction, compared = truth
    expected = np.where(nearest[..., None] >= 0, -direction, 0)
    np.testing.assert_allclose(image["outgoing"][compared], expected[compared], atol=1e-5)


def test_albedo_and_roughness(image, truth) -> None:
    nearest, _, _, compared = truth
    nothing = [0, 0, 0]  # the lamp has no BSDF of its own, Mitsuba gives it a black one
    white, clay = [0.7] * 3, [0.2, 0.3, 0.6]
    albedo = np.array([white, white, [0.2, 0.9, 0.4], clay, nothing, nothing])
    roughness = np.array([1, 1, 1, 0.3, 1, 0])
    np.testing.assert_allclose(image["albedo"][compared], albedo[nearest][compared], atol=1e-5)
    np.testing.assert_allclose(
        image["roughness"][..., 0][compared], roughness[nearest][compared], atol=1e-5
    )


def test_figure_carries_its_variable_roughness(image) -> None:
    metal = np.isclose(image["albedo"], [0.8, 0.7, 0.3], atol=1e-5).all(-1)
    assert metal.any()
    np.testing.assert_allclose(image["roughness"][metal], 0.2, atol=1e-5)


def test_emission_is_log1p_of_what_the_lamp_emits(image, truth) -> None:
    nearest, _, _, compared = truth
    lamp = np.log1p(2 * np.array([10, 8, 6]))  # v = 1 is twice the authored radiance
    expected = np.where((nearest == 4)[..., None], lamp, 0)
    np.testing.assert_allclose(image["emission"][compared], expected[compared], atol=1e-5)


def test_box_filter_averages_over_the_pixel(load_box) -> None:
    fine = load_box("llvm", buffer_samples=1, patch_size=16)
    coarse = load_box("llvm", buffer_samples=64, patch_size=16)
    image = coarse.image_buffers(V, resolution=16)
    blocks = fine.image_buffers(V, resolution=256)
    mean = blocks.reshape(16, 16, 16, 16, -1).mean((1, 3))
    linear = [
        i for name in ("position", "albedo") for i in range(*fine.layout.slice(name).indices(99))
    ]
    difference = (image - mean)[..., linear].abs()
    assert difference.max() < 0.1
    assert difference.mean() < 0.003


@pytest.mark.parametrize("backend", ["llvm", "scalar"])
def test_fewer_rays_than_usual_are_those_of_a_renderer_that_has_as_few(load_box, backend) -> None:
    usual, few = (load_box(backend, buffer_samples=n, patch_size=16) for n in (2, 1))
    fewer = usual.image_buffers(V, resolution=16, samples=1)
    assert torch.equal(fewer, few.image_buffers(V, resolution=16))
    whole = usual.image_buffers(V, resolution=16)
    assert not torch.equal(fewer, whole)
    assert torch.equal(whole, usual.image_buffers(V, resolution=16, samples=2))


def test_no_rays_at_all_are_refused(load_box) -> None:
    with pytest.raises(ValueError, match="samples"):
        load_box("llvm", buffer_samples=1, patch_size=16).image_buffers(V, resolution=16, samples=0)
