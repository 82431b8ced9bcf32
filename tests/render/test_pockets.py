import math

import pytest
import torch
from torch.quasirandom import SobolEngine

from ngi.render import PocketRenderer


def make(**arguments) -> PocketRenderer:
    defaults = {
        "dimensions": 3, "volume": 0.1, "pockets": 1, "sharpness": 0.5, "patch_size": 8,
    }  # fmt: skip
    return PocketRenderer(**{**defaults, **arguments})


def weight(d: float, *, side: float, sharpness: float) -> float:
    """The soft box function as the class defines it, for one number."""
    edge = (1 - sharpness) * min(side, 1 - side)
    t = min(1.0, max(0.0, (side / 2 - abs(d)) / edge + 0.5))
    return t * t * (3 - 2 * t)


def without_effects(v: torch.Tensor) -> torch.Tensor:
    """A point as far from the only pocket as the torus allows, along one variable."""
    far = v.clone()
    far[0] = (make().centres[0, 0] + 0.5) % 1
    return far


def image(renderer: PocketRenderer, v: torch.Tensor) -> torch.Tensor:
    return renderer.render_image(v, resolution=16, samples_per_pixel=1, seed=0)


@pytest.mark.parametrize("sharpness", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(
    ("volume", "pockets", "active", "dimensions"),
    [(0.1, 1, 2, 2), (0.02, 4, 3, 5), (0.5, 1, 4, 4), (0.3, 7, 1, 2)],
)
def test_the_mean_of_all_weights_is_the_volume(
    volume, pockets, active, dimensions, sharpness
) -> None:
    renderer = make(
        volume=volume, pockets=pockets, active=active, dimensions=dimensions, sharpness=sharpness
    )
    points = SobolEngine(dimensions, scramble=True, seed=1).draw(2**15)
    mean = renderer.weights(points).sum(dim=1).mean()
    torch.testing.assert_close(mean, torch.tensor(volume), rtol=0.03, atol=0)


def test_weights_are_the_product_of_soft_boxes_on_the_torus() -> None:
    renderer = make(pockets=3, active=2)
    v = torch.rand(50, 3, generator=torch.Generator().manual_seed(0))
    for point, weights in zip(v, renderer.weights(v), strict=True):
        for centre, found in zip(renderer.centres, weights, strict=True):
            expected = 1.0
            for a in range(2):
                d = abs(float(point[a] - centre[a]))
                expected *= weight(min(d, 1 - d), side=renderer.side, sharpness=0.5)
            assert float(found) == pytest.approx(expected, abs=1e-5)


def test_a_sharp_pocket_is_a_box() -> None:
    renderer = make(sharpness=1.0, active=3, volume=0.2)
    corner = renderer.centres[0] + 0.499 * renderer.side
    beside = renderer.centres[0] + torch.tensor([0.501, 0.0, 0.0]) * renderer.side
    assert renderer.weights(torch.stack([corner, beside]) % 1).tolist() == [[1.0], [0.0]]


def test_points_taken_into_pockets_are_uniform_in_their_boxes() -> None:
    renderer = make(pockets=2, active=2, dimensions=4, volume=0.5)  # across the torus' seam
    points = torch.rand(400, 4, generator=torch.Generator().manual_seed(0))
    moved = renderer.into_pockets(points)
    centre = renderer.centres[torch.arange(400) % 2]
    offset = (moved[:, :2] - centre + 0.5) % 1 - 0.5
    torch.testing.assert_close(offset / renderer.side + 0.5, points[:, :2], atol=1e-5, rtol=0)
    torch.testing.assert_close(moved[:, 2:], points[:, 2:])
    assert ((moved >= 0) & (moved <= 1)).all()


def test_hard_frames_are_in_pockets() -> None:
    renderer = make(pockets=3, volume=1e-4, sharpness=1.0)
    frames = renderer.hard_frames()
    assert frames.shape == (10, 3)
    assert len(frames.unique(dim=0)) == 10
    assert (renderer.weights(frames).sum(dim=1) == 1).all()


def test_an_effect_is_bright_and_nothing_shows_elsewhere() -> None:
    renderer = make()
    inside, outside = renderer.centres[0], without_effects(renderer.centres[0])
    assert renderer.weights(outside[None]).item() == 0
    assert image(renderer, inside).mean() > 3 * image(renderer, outside).mean()
    buffers = renderer.image_buffers(outside, resolution=16)
    x, y = buffers[..., 0], buffers[..., 1]
    spot = torch.exp(-((x - 0.5) ** 2 + (y - 0.5) ** 2) / (2 * 0.25**2))[..., None]
    expected = buffers[..., 3:] * (0.2 + 3 * spot)
    torch.testing.assert_close(image(renderer, outside), expected)


def test_an_effect_is_as_bright_as_its_weight() -> None:
    """Soft and sharp pockets differ in nothing else, and a sharp one is all on inside."""
    soft, sharp = (make(active=2, sharpness=sharpness) for sharpness in (0.0, 1.0))
    v = torch.cat([soft.centres[0] + soft.side * torch.tensor([0.3, -0.1]), torch.tensor([0.4])])
    weight = soft.weights(v[None]).item()
    assert 0.3 < weight < 0.9
    plane = image(make_plane(soft), v)
    torch.testing.assert_close(
        image(soft, v) - plane, weight * (image(sharp, v) - plane), atol=1e-4, rtol=1e-4
    )


def test_the_pattern_moves_within_a_pocket() -> None:
    """Two points of equal weight, on either side of the centre, differ by more than their plane."""
    renderer = make(active=1, dimensions=1, volume=0.4, sharpness=1.0)
    centre = renderer.centres[0]
    shares = []
    for offset in (-0.15, 0.15):
        v = (centre + offset) % 1
        albedo = renderer.image_buffers(v, resolution=16)[..., 3:]
        effect = image(renderer, v) - image(make_plane(renderer), v)
        assert albedo.shape == effect.shape
        shares.append(effect / effect.sum())
    assert (shares[0] - shares[1]).abs().sum() > 0.1


def make_plane(renderer: PocketRenderer) -> PocketRenderer:
    """The same scene with its pocket too small to be met."""
    plane = make(dimensions=renderer.dimensions, active=renderer.active, volume=1e-6)
    plane.centres = plane.centres + 0.5
    return plane


def test_variables_that_are_not_active_change_the_albedo_only() -> None:
    renderer = make(dimensions=4, active=2)
    v = torch.cat([renderer.centres[0], torch.tensor([0.2, 0.7])])
    moved = torch.cat([renderer.centres[0], torch.tensor([0.6, 0.1])])
    assert not torch.equal(
        renderer.image_buffers(v, resolution=8), renderer.image_buffers(moved, resolution=8)
    )
    plane = make_plane(renderer)
    torch.testing.assert_close(
        image(renderer, v) - image(plane, v), image(renderer, moved) - image(plane, moved),
        atol=1e-4, rtol=0,
    )  # fmt: skip


def test_a_patch_does_not_depend_on_its_batch() -> None:
    renderer = make(noise=0.1, pockets=2, volume=0.5)
    states = torch.rand(9, 5, generator=torch.Generator().manual_seed(0))
    together = renderer.render_patches(states, resolution=20, seed=3)
    for i in range(9):
        alone = renderer.render_patches(states[i : i + 1], resolution=20, seed=3)
        assert torch.equal(alone.log_radiance[0], together.log_radiance[i])
        assert torch.equal(alone.buffers[0], together.buffers[i])
    window = renderer.whole_image(states[0, :3], 20)[0]
    x, y = (int(p * 13) for p in states[0, 3:])
    torch.testing.assert_close(together.buffers[0], window[y : y + 8, x : x + 8])


def test_active_variables_are_four_or_as_many_as_there_are() -> None:
    assert [make(dimensions=d).active for d in (1, 3, 4, 9)] == [1, 3, 4, 4]
    assert make(dimensions=8, volume=0.01, pockets=2, active=5).side == pytest.approx(
        math.exp(math.log(0.005) / 5)
    )


def test_hash_follows_whatever_changes_an_image() -> None:
    changes = [
        {}, {"volume": 0.2}, {"pockets": 2}, {"sharpness": 0.6}, {"active": 2}, {"noise": 0.1},
        {"dimensions": 4},
    ]  # fmt: skip
    assert len({make(**change).scene_hash for change in changes}) == len(changes)
    assert make(patch_size=16).scene_hash == make().scene_hash


@pytest.mark.parametrize(
    "bad",
    [
        {"volume": 0.0},
        {"volume": 0.6},
        {"volume": math.nan},
        {"pockets": 0},
        {"sharpness": -0.1},
        {"sharpness": 1.1},
        {"active": 0},
        {"active": 4},
        {"noise": -1.0},
        {"dimensions": 0},
    ],
)
def test_bad_construction_names_the_number(bad) -> None:
    with pytest.raises(ValueError, match=rf"renderer.*{next(iter(bad))} is"):
        make(**bad)
