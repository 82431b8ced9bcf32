import pytest
import torch

from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer


def make(**arguments):
    return AnalyticRenderer(**{"dimensions": 3, "patch_size": 8, **arguments})


def states(n, dimensions=3, seed=0):
    return torch.rand(n, dimensions + 2, generator=torch.Generator().manual_seed(seed))


def test_patch_equals_the_same_pixels_of_the_image() -> None:
    renderer = make()
    state = states(1)
    patch = renderer.render_patches(state, resolution=20, seed=0)
    image = renderer.render_image(state[0, :3], resolution=20, samples_per_pixel=1, seed=0)
    buffers = renderer.image_buffers(state[0, :3], resolution=20)
    x, y = (int(p * 13) for p in state[0, 3:])
    torch.testing.assert_close(patch.buffers[0], buffers[y : y + 8, x : x + 8])
    torch.testing.assert_close(patch.log_radiance[0].expm1(), image[y : y + 8, x : x + 8])


@pytest.mark.parametrize("dimensions", [1, 2, 7, 128])
def test_radiance_depends_on_every_component_of_v(dimensions) -> None:
    renderer = make(dimensions=dimensions)
    v = torch.full((dimensions,), 0.5, dtype=torch.float32)
    image = renderer.render_image(v, resolution=8, samples_per_pixel=1, seed=0)
    for i in range(dimensions):
        moved = v.clone()
        moved[i] = 0.8
        other = renderer.render_image(moved, resolution=8, samples_per_pixel=1, seed=0)
        assert (image - other).abs().max() > 1e-2


def test_lamp_shows_in_radiance_and_emission_alike() -> None:
    v = torch.tensor([0.2, 0.5, 0.9])
    radiance = make().render_image(v, resolution=64, samples_per_pixel=1, seed=0)
    without = make(layout=BufferLayout(("position", "roughness")))
    assert without.image_buffers(v, resolution=64).shape == (64, 64, 4)
    emission = make().image_buffers(v, resolution=64)[..., BufferLayout().slice("emission")].expm1()
    lit = emission[..., 0] > 0
    assert abs(lit.float().mean() - torch.pi * 0.08**2) < 2e-3
    torch.testing.assert_close(emission[lit], torch.full_like(emission[lit], 3))
    assert (radiance[lit] > 3).all()


def test_noise_is_seeded_per_state_and_falls_with_the_samples() -> None:
    clean = make().render_patches(states(4), resolution=16, seed=0).log_radiance.expm1()
    noisy = make(noise=0.2, samples_per_pixel=4)
    a = noisy.render_patches(states(4), resolution=16, seed=0).log_radiance
    assert torch.equal(a, noisy.render_patches(states(4), resolution=16, seed=0).log_radiance)
    assert torch.equal(
        a[1:2], noisy.render_patches(states(4)[1:2], resolution=16, seed=0).log_radiance
    )
    assert not torch.equal(a, noisy.render_patches(states(4), resolution=16, seed=1).log_radiance)
    error = (a.expm1() / clean - 1).std()
    torch.testing.assert_close(error, torch.tensor(0.1), atol=0.01, rtol=0)


def test_noise_of_two_patches_is_not_the_same() -> None:
    same_place = states(2)
    same_place[1, :-2] = 0.5
    same_place[:, -2:] = 0.3
    clean = make().render_patches(same_place, resolution=16, seed=0).log_radiance.expm1()
    noisy = make(noise=0.2).render_patches(same_place, resolution=16, seed=0).log_radiance.expm1()
    error = (noisy / clean - 1).flatten(1)
    assert abs(torch.corrcoef(error)[0, 1]) < 0.3


def test_pixels_are_evaluated_at_their_centres() -> None:
    position = make().image_buffers(torch.rand(3), resolution=4)[..., :3]
    centres = torch.tensor([0.125, 0.375, 0.625, 0.875])
    torch.testing.assert_close(position[2, :, 0], centres)
    torch.testing.assert_close(position[:, 1, 1], centres)


def test_hard_frames_and_hash() -> None:
    frames = make(dimensions=5).hard_frames()
    assert frames.shape == (10, 5)
    assert ((frames >= 0) & (frames <= 1)).all()
    assert len(frames.unique(dim=0)) == 10
    assert make().scene_hash == make(patch_size=4).scene_hash != make(dimensions=4).scene_hash


def test_hash_follows_whatever_changes_an_image(monkeypatch) -> None:
    renderers = [make(), make(noise=0.1), make(noise=0.2), make(layout=BufferLayout(("position",)))]
    hashes = {renderer.scene_hash for renderer in renderers}
    monkeypatch.setattr("ngi.render.analytic.FORMULA_VERSION", 2)
    assert len(hashes | {make().scene_hash}) == 5


@pytest.mark.parametrize("bad", [{"dimensions": 0}, {"patch_size": 0}, {"noise": -1.0}])
def test_bad_construction(bad) -> None:
    with pytest.raises(ValueError, match=next(iter(bad))):
        make(**bad)


def test_bad_states() -> None:
    with pytest.raises(ValueError, match="expected \\[n, 5\\]"):
        make().render_patches(torch.rand(2, 4), resolution=16, seed=0)
    with pytest.raises(ValueError, match="larger than the image"):
        make().render_patches(torch.rand(2, 5), resolution=7, seed=0)
