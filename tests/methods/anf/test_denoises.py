"""The denoiser ANF on a scene that Mitsuba traces."""

import pytest
import torch
import torch.nn.functional as F
from torch import Tensor

from ngi.evaluate import dssim, mape
from ngi.machine.backend import llvm_problem
from ngi.methods.anf import AffinityDenoiser, Sequences, SequenceSmape
from ngi.patches import Patches
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene
from tests.render.box import BOX

SIZE, FRAMES = 32, 3
COPIES = 4  # sequences of the same v, each with noise of its own


@pytest.fixture(scope="module")
def renderer() -> MitsubaRenderer:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    return MitsubaRenderer(
        scene=read_scene(BOX), backend="llvm", patch_size=SIZE, samples_per_pixel=2
    )


def still_sequences(samples: Sequences, v: Tensor) -> Patches:
    """Whole images: where the patch is decides on nothing but the noise."""
    still = torch.cat([v, torch.full_like(v, 0.5)]).repeat(COPIES, 1)
    position = torch.rand(COPIES, 2, generator=torch.Generator().manual_seed(0))
    states = torch.cat([still, position], dim=1)
    found = samples.start_patches(states, resolution=SIZE, seed=1).result()
    return Patches(
        scene_vector=still,
        position=position,
        resolution=torch.full((COPIES,), SIZE),
        large_step=torch.ones(COPIES, dtype=torch.bool),
        buffers=found.buffers,
        log_radiance=found.log_radiance,
    )


def gaussian_blurred(image: Tensor, sigma: float) -> Tensor:
    """[H, W, 3] to the same, mirrored at the border."""
    offsets = torch.arange(-4, 5).float()
    window = torch.exp(-0.5 * (offsets / sigma) ** 2)
    window = window / window.sum()
    planes = F.pad(image.movedim(-1, 0)[:, None], [4] * 4, mode="reflect")
    return F.conv2d(F.conv2d(planes, window[None, None, None]), window[None, None, :, None])[
        :, 0
    ].movedim(0, -1)


def test_one_configuration_becomes_cleaner_than_its_input_and_than_blurs_of_it(
    renderer: MitsubaRenderer,
) -> None:
    samples = Sequences(renderer=renderer, frames=FRAMES, target_renderings=16, reach=0.1)
    v = renderer.hard_frames()[0]
    inputs, target = samples.example(still_sequences(samples, v))
    with torch.random.fork_rng():
        torch.manual_seed(0)
        net = AffinityDenoiser(
            layout=samples.layout, hidden_features=32, hidden_layers=4,
            kernel_size=3, dilations=(1, 2, 4),
        )  # fmt: skip
    optimizer = torch.optim.Adam(net.parameters(), lr=3e-3)
    loss = SequenceSmape(temporal_weight=0.25)
    for _ in range(100):
        optimizer.zero_grad()
        loss(net(*inputs), target).mean().backward()
        optimizer.step()
    truth = renderer.render_image(v, resolution=SIZE, samples_per_pixel=2048, seed=5).cpu()
    buffers = renderer.image_buffers(v, resolution=SIZE).cpu()
    noise = torch.Generator().manual_seed(9)  # sequences that it was not trained on
    seeds = torch.randint(1 << 30, (FRAMES,), generator=noise).tolist()
    frames = [
        renderer.render_image(v, resolution=SIZE, samples_per_pixel=2, seed=seed).cpu()
        for seed in seeds
    ]
    found = net.render(
        buffers, torch.stack(frames).log1p(), buffers.repeat(FRAMES - 1, 1, 1, 1), inputs[2][0]
    )
    denoised, noisy = torch.expm1(found), frames[-1]
    blurred = [gaussian_blurred(noisy, sigma) for sigma in (0.5, 1.0, 2.0)]
    for error in (lambda image: mape(image, truth, 0.01), lambda image: dssim(image, truth)):
        assert error(denoised) < 0.7 * error(noisy)
        assert error(denoised) < 0.9 * min(map(error, blurred))
