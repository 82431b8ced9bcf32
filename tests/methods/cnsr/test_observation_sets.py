"""Sets of observations: which images they are made of, and what of them the network is given."""

from dataclasses import replace

import pytest
import torch
from hydra.utils import instantiate

from ngi.evaluate import evaluation_frames
from ngi.explore import Proposals
from ngi.learn.ahead import ProposalsAhead
from ngi.methods.cnsr import ObservationSets
from ngi.patches import Patches
from ngi.render import AnalyticRenderer
from ngi.reuse import CompactPatches
from tests.learn.composition import run_config
from tests.learn.moving_camera import SCENE_VARIABLES, MovingCamera

SIZE, OBSERVATIONS = 12, 3
D = SCENE_VARIABLES + 2


@pytest.fixture
def renderer() -> MovingCamera:
    return MovingCamera(patch_size=SIZE, noise=0.1)


@pytest.fixture
def samples(renderer: MovingCamera) -> ObservationSets:
    return ObservationSets(renderer=renderer, observations=OBSERVATIONS)


def sets(samples: ObservationSets, count: int = 2, seed: int = 0) -> Patches:
    states = torch.rand(
        count, samples.dimensions + 2, generator=torch.Generator().manual_seed(seed)
    )
    proposals = Proposals(states, torch.ones(count, dtype=torch.bool))
    ahead = ProposalsAhead(proposals, resolution=SIZE, seed=5)
    ahead.start(samples)
    return ahead.patches()


def test_a_set_shows_one_scene_from_the_cameras_of_its_state(samples) -> None:
    clean = MovingCamera(patch_size=SIZE)
    made = sets(samples)
    assert samples.dimensions == D + 2 * OBSERVATIONS
    assert made.buffers.shape == (2, 1 + OBSERVATIONS, SIZE, SIZE, samples.layout.channels)
    for state, buffers, log_radiance in zip(
        made.scene_vector, made.buffers, made.log_radiance, strict=True
    ):
        scene, *cameras = state.split([SCENE_VARIABLES, *[2] * (1 + OBSERVATIONS)])
        for image, camera in enumerate(cameras):
            v = torch.cat([scene, camera])
            expected, radiance = clean.whole_image(v, SIZE)
            torch.testing.assert_close(buffers[image], expected)
            noise = torch.expm1(log_radiance[image]) / radiance - 1
            assert 0.05 < noise.std() < 0.15


def test_images_of_one_view_have_noise_of_their_own() -> None:
    still = AnalyticRenderer(dimensions=3, patch_size=SIZE, noise=0.1)
    samples = ObservationSets(renderer=still, observations=OBSERVATIONS)
    assert samples.dimensions == 3
    made = sets(samples)
    images = made.log_radiance[0]
    for a in range(1 + OBSERVATIONS):
        assert torch.equal(made.buffers[0, a], made.buffers[0, 0])
        for b in range(a):
            assert not torch.allclose(images[a], images[b])
    _, observations, _ = samples.test_inputs(torch.full((3,), 0.5), torch.zeros(24, 24, 1))
    assert not torch.allclose(observations[0], observations[1])


def test_the_network_sees_the_scene_by_its_observations_alone(samples, renderer) -> None:
    made = sets(samples)
    (buffers, camera, observations, cameras), target = samples.example(made)
    assert torch.equal(buffers, made.buffers[:, 0])
    assert torch.equal(target, made.log_radiance[:, 0])
    images = torch.cat([made.buffers, made.log_radiance], dim=-1)
    assert torch.equal(observations, images[:, 1:])
    assert torch.equal(camera, renderer.cameras(made.scene_vector[:, :D]))
    last = torch.cat([made.scene_vector[:, :SCENE_VARIABLES], made.scene_vector[:, -2:]], dim=1)
    assert torch.equal(cameras[:, -1], renderer.cameras(last))
    other = made.scene_vector.clone()
    other[:, :SCENE_VARIABLES] = 0.123
    again, _ = samples.example(replace(made, scene_vector=other))
    for a, b in zip(again, (buffers, camera, observations, cameras), strict=True):
        assert torch.equal(a, b)


def test_any_image_of_a_stored_set_becomes_the_query(samples) -> None:
    made = sets(samples)
    stored = CompactPatches.compress(made, samples.layout).expand()
    generator = torch.Generator().manual_seed(1)
    queries = set()
    for _ in range(40):
        mixed = samples.rearranged(stored, generator)
        (buffers, camera, observations, cameras), target = samples.example(mixed)
        views = torch.cat([camera[:, None], cameras], dim=1)
        images = torch.cat([buffers[:, None], observations[..., : buffers.shape[-1]]], dim=1)
        for index in range(1 + OBSERVATIONS):
            # The world position in the middle of an image is half a view from its camera's corner.
            middle = images[:, index, SIZE // 2 - 1 : SIZE // 2 + 1, SIZE // 2 - 1 : SIZE // 2 + 1]
            found = middle[..., :2].mean(dim=(1, 2))
            torch.testing.assert_close(found, views[:, index, :2], rtol=0, atol=1e-5)
        radiance = torch.cat([target[:, None], observations[..., -3:]], dim=1)
        difference = (stored.log_radiance[:, None] - radiance[:, :, None]).abs().sum((3, 4, 5))
        assert (difference == 0).sum() == 2 * (1 + OBSERVATIONS), "every image is there once"
        queries.add(int((difference[0, 0] == 0).nonzero()))
    assert queries == set(range(1 + OBSERVATIONS))


def test_a_test_frame_is_observed_in_its_own_scene_always_from_the_same_cameras(samples) -> None:
    first, second = torch.tensor([0.2, 0.7, 0.1, 0.9]), torch.tensor([0.6, 0.1, 0.5, 0.5])
    clean = ObservationSets(renderer=MovingCamera(patch_size=SIZE), observations=OBSERVATIONS)
    frames = {v: clean.test_inputs(v, torch.zeros(48, 48, 1)) for v in (first, second)}
    for v, (camera, observations, cameras) in frames.items():
        assert torch.equal(camera, MovingCamera(patch_size=SIZE).cameras(v[None])[0])
        for observation, seen_from in zip(observations, cameras, strict=True):
            corner = 2 * (seen_from[:2] - 0.25)
            expected, radiance = MovingCamera(patch_size=SIZE).whole_image(
                torch.cat([v[:SCENE_VARIABLES], corner]), SIZE
            )
            image = torch.cat([expected, torch.log1p(radiance)], dim=-1)
            torch.testing.assert_close(observation, image)
    assert torch.equal(frames[first][2], frames[second][2])
    assert len(frames[first][2].unique(dim=0)) == OBSERVATIONS
    again = samples.test_inputs(first, torch.zeros(48, 48, 1))
    for a, b in zip(again, samples.test_inputs(first, torch.zeros(96, 96, 1)), strict=True):
        assert torch.equal(a, b)


def test_no_test_frame_is_observed_from_its_own_camera(samples, renderer) -> None:
    """Sobol sequences of one seed begin with the same point, however many dimensions they have."""
    tested = evaluation_frames(renderer, instantiate(run_config().evaluation.evaluator.protocol))
    frames = torch.stack([frame.scene_vector for frame in tested if frame.set == "uniform"])
    observed_from = 2 * (samples.test_inputs(frames[0], torch.zeros(48, 48, 1))[2][:, :2] - 0.25)
    for first in range(D - 1):  # wherever in v the camera is
        assert torch.cdist(observed_from, frames[:, first : first + 2]).min() > 1e-3


def test_blank_sets_have_the_shapes_of_rendered_ones(samples) -> None:
    blank, made = samples.blank(2), sets(samples)
    for name in ("scene_vector", "position", "buffers", "log_radiance"):
        assert getattr(blank, name).shape == getattr(made, name).shape
    assert [t.shape for t in samples.example(blank)[0]] == [
        t.shape for t in samples.example(made)[0]
    ]


def test_every_image_counts_as_traced() -> None:
    still = ObservationSets(renderer=MovingCamera(patch_size=SIZE), observations=OBSERVATIONS)
    job = still.start_patches(torch.zeros(2, still.dimensions + 2), resolution=SIZE, seed=0)
    assert job.done()
    assert job.result().paths == 2 * (1 + OBSERVATIONS) * SIZE**2


def test_what_is_no_set_is_refused(renderer, samples) -> None:
    with pytest.raises(ValueError, match=r"data.observations is 0"):
        ObservationSets(renderer=renderer, observations=0)
    samples.check_resolution(SIZE)
    for pixels in (SIZE - 1, SIZE + 4):
        with pytest.raises(ValueError, match=f"{pixels} pixels .* renderer.patch_size = {SIZE}"):
            samples.check_resolution(pixels)
    with pytest.raises(ValueError, match=r"expected \[n, 12\]"):
        samples.start_patches(torch.zeros(1, D + 2), resolution=SIZE, seed=0)
