"""Sequences of noisy frames, on closed formulas with a camera that v moves."""

from math import sqrt

import pytest
import torch
from torch import Tensor

from ngi.methods.anf import Sequences
from ngi.methods.anf.affinity import warped
from ngi.methods.anf.sequences import TEST_SEED
from ngi.patches import Patches
from ngi.render import AnalyticRenderer
from tests.learn.moving_camera import MovingCamera

PATCH, RESOLUTION, FRAMES, RENDERINGS = 16, 32, 4, 3
NOISE = 0.1


class Walking(MovingCamera):
    """The camera sees a square of half a unit, whose corner the last two variables say."""

    def projections(self, scene_vectors: Tensor) -> Tensor:
        matrices = 2 * torch.eye(4).repeat(len(scene_vectors), 1, 1)
        matrices[:, :2, 3] = -scene_vectors[:, self.camera_part]
        matrices[:, 3, 3] = 1
        return matrices


def sequences(noise: float = 0.0, reach: float = 0.5) -> Sequences:
    return Sequences(
        renderer=Walking(patch_size=PATCH, noise=noise),
        frames=FRAMES,
        target_renderings=RENDERINGS,
        reach=reach,
    )


def rendered(
    samples: Sequences, states: Tensor, seed: int = 0, resolution: int = RESOLUTION
) -> Patches:
    found = samples.start_patches(states, resolution=resolution, seed=seed).result()
    return Patches(
        scene_vector=states[:, :-2],
        position=states[:, -2:],
        resolution=torch.full((len(states),), resolution),
        large_step=torch.ones(len(states), dtype=torch.bool),
        buffers=found.buffers,
        log_radiance=found.log_radiance,
    )


def states(count: int = 3) -> Tensor:
    return torch.rand(count, 2 * 4 + 2, generator=torch.Generator().manual_seed(1))


def assert_shown_before(
    buffers: Tensor, sources: Tensor, samples: Sequences, *, resolution: int
) -> None:
    """What a pixel shows lay within half a pixel of its source, in the frame before."""
    position = buffers[..., samples.layout.slice("position")].movedim(-1, 1)
    there, found = warped(position[:-1], sources)
    apart = ((there - position[1:]) * found).abs().max()
    assert apart <= 0.5 * 0.5 / resolution + 1e-6  # of half a unit


def test_a_path_is_a_line_within_the_hypercube() -> None:
    samples = sequences()
    v = torch.tensor([[0.5, 0.5, 0.9, 0.1], [0.5, 0.5, 0.5, 0.5]])
    direction = torch.tensor([[0.5, 1.0, 1.0, 0.0], [0.5] * 4])
    path = samples.path(torch.cat([v, direction], dim=1))
    expected = [[0.5, 0.5, 0.9, 0.1], [0.5, 2 / 3, 1, 0], [0.5, 0.5 + 1 / 3, 1, 0], [0.5, 1, 1, 0]]
    torch.testing.assert_close(path[0], torch.tensor(expected))
    assert torch.equal(path[1], v[1].expand(FRAMES, -1))


def test_every_frame_is_the_renderers_patch_at_its_v() -> None:
    samples, given = sequences(), states()
    patches = rendered(samples, given)
    assert patches.buffers.shape == (3, FRAMES, PATCH, PATCH, samples.layout.channels)
    assert patches.log_radiance.shape == (3, 2, FRAMES, PATCH, PATCH, 3)
    renderer = Walking(patch_size=PATCH)
    for frame, v in enumerate(samples.path(given[:, :-2]).unbind(dim=1)):
        there = torch.cat([v, given[:, -2:]], dim=1)
        expected = renderer.render_patches(there, resolution=RESOLUTION, seed=0)
        torch.testing.assert_close(patches.buffers[:, frame], expected.buffers)
        for which in range(2):
            torch.testing.assert_close(patches.log_radiance[:, which, frame], expected.log_radiance)


def test_targets_have_less_noise_and_noise_of_their_own() -> None:
    given = states()
    clean = torch.expm1(rendered(sequences(), given).log_radiance)
    errors = torch.expm1(rendered(sequences(NOISE), given).log_radiance) / clean - 1
    noisy, target = errors.unbind(dim=1)
    assert noisy.std().item() == pytest.approx(NOISE, rel=0.05)
    assert target.std().item() == pytest.approx(NOISE / sqrt(RENDERINGS), rel=0.05)
    both = torch.corrcoef(torch.stack([noisy.flatten(), target.flatten()]))
    assert abs(both[0, 1]) < 0.02
    frames = torch.corrcoef(noisy.transpose(0, 1).flatten(1))
    assert (frames - torch.eye(FRAMES)).abs().max() < 0.08


def test_all_paths_are_counted() -> None:
    job = sequences().start_patches(states(), resolution=RESOLUTION, seed=0)
    assert job.result().paths == 3 * FRAMES * (1 + RENDERINGS) * PATCH**2


def test_a_frame_before_is_found_by_its_camera() -> None:
    """The camera moves by a pixel and a half across: a surface was one or two pixels further."""
    samples = sequences(reach=3 * 1.5 / RESOLUTION)
    v = torch.tensor([0.5, 0.5, 0.5, 0.5])
    right = torch.tensor([0.5, 0.5, 1.0, 0.5])
    patches = rendered(samples, torch.cat([v, right, torch.tensor([0.5, 0.5])])[None])
    (buffers, _, sources), _ = samples.example(patches)
    column = torch.arange(PATCH)
    shift = (sources[0, 0] % PATCH) - column
    known = sources[0, 0] >= 0
    assert set(shift[known].tolist()) <= {1, 2}
    assert known.float().mean() > 0.85
    assert not known[:, -1].any()
    assert_shown_before(buffers[0], sources[0], samples, resolution=RESOLUTION)


def test_test_frames_are_led_to_and_are_themselves_the_last() -> None:
    """By frames of the same v each: their noisy pictures, their buffers and their cameras."""
    samples = sequences(reach=0.3)
    v = torch.tensor([0.4, 0.4, 0.6, 0.6])
    renderer = Walking(patch_size=PATCH)
    buffers = renderer.image_buffers(v, resolution=24)
    noisy, earlier, sources = samples.test_inputs(v, buffers)
    assert noisy.shape == (FRAMES, 24, 24, 3)
    assert earlier.shape == (FRAMES - 1, 24, 24, samples.layout.channels)
    assert sources.shape == (FRAMES - 1, 24, 24)
    back = torch.rand(4, generator=torch.Generator().manual_seed(TEST_SEED))
    path = [v + time * 0.3 * (2 * back - 1) for time in (1, 2 / 3, 1 / 3, 0)]
    for frame, there in enumerate(path):
        at_frame, clean = renderer.whole_image(there, 24)
        torch.testing.assert_close(torch.expm1(noisy[frame]), clean)
        if frame < FRAMES - 1:
            torch.testing.assert_close(earlier[frame], at_frame)
    assert (sources >= 0).float().mean() > 0.7
    of_path = torch.cat([earlier, buffers[None]])
    assert_shown_before(of_path, sources, samples, resolution=24)
    again = samples.test_inputs(v, buffers)
    assert all(torch.equal(a, b) for a, b in zip((noisy, earlier, sources), again, strict=True))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frames": 1}, "data.frames is 1"),
        ({"target_renderings": 0}, "data.target_renderings 0"),
        ({"reach": 0.0}, "data.reach 0"),
        ({"reach": float("nan")}, "data.reach nan"),
    ],
)
def test_wrong_numbers_are_named(changes: dict[str, float], message: str) -> None:
    arguments = {"frames": 2, "target_renderings": 1, "reach": 0.1, **changes}
    with pytest.raises(ValueError, match=message):
        Sequences(renderer=AnalyticRenderer(dimensions=3, patch_size=8), **arguments)


def test_where_a_pixel_was_does_not_depend_on_the_precision_of_training() -> None:
    samples = sequences()
    patches = rendered(samples, states(), resolution=256)
    (_, _, expected), _ = samples.example(patches)
    with torch.autocast("cpu", torch.bfloat16):
        (_, _, sources), _ = samples.example(patches)
    assert (expected >= 0).any()
    torch.testing.assert_close(sources, expected, rtol=0, atol=0)
