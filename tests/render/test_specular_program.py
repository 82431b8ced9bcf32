"""Traced bounces in all backends, in patches, and in a training run."""

import numpy as np
import pytest
import torch

from ngi.machine.backend import llvm_problem
from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer
from ngi.studies.benchmark.measure import counted_kernels
from tests.render.optics import (
    rectangle,
)
from tests.render.specular_scenes import (
    BACK,
    BALL,
    PICTURE,
    PLAIN,
    ROUGH,
    SCENES,
    SIDE,
    SKY,
    STEEL,
    TILTED,
    buffers,
)
from tests.render.trained import stored_buffers


def test_llvm_equals_scalar(load_specular) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    for name in ("sphere", "mirror and slab"):
        fov = 32 if name == "sphere" else 20
        a, b = (
            buffers(load_specular(SCENES[name], backend=b, fov=fov)) for b in ("llvm", "scalar")
        )
        assert a.keys() == b.keys()
        different = np.any([(abs(a[n] - b[n]) > 1e-2).any(-1) for n in a], axis=0)
        assert different.mean() < 0.01  # rays that meet an edge


def test_patches_show_the_same_and_nothing_is_compiled_after_warm_up(load_specular) -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    steel = ROUGH.format(alpha='<float name="alpha" value="0.3"/>')
    ball = BALL.replace("<shape", '<shape id="ball"', 1)
    shapes = BACK + SIDE + SKY + rectangle("mirror", TILTED, steel) + ball
    shapes = shapes.replace(PICTURE, PLAIN)  # a frozen function can't sample a textured emitter
    ball_moves = "{object: ball, property: translation, minimum: [0, -1, 0], maximum: [0, 1, 0]}"
    renderer = load_specular(shapes, backend="llvm", variables=[STEEL, ball_moves])
    renderer.warm_up()
    generator = torch.Generator().manual_seed(0)
    states = [torch.rand(4, 4, generator=generator) for _ in range(20)]
    with counted_kernels() as kernels:
        rendered = [renderer.render_patches(s, resolution=24, seed=i) for i, s in enumerate(states)]
    assert kernels.compiled == 0
    for state, patch in zip(states[-1], rendered[-1].buffers, strict=True):
        column, row = (min(int(p * 17), 16) for p in state[2:].tolist())
        image = renderer.image_buffers(state[:2], resolution=24)
        torch.testing.assert_close(
            patch, image[row : row + 8, column : column + 8], atol=1e-5, rtol=0
        )


def test_other_words_are_refused(load_specular) -> None:
    with pytest.raises(ValueError, match="choose one of learned, traced"):
        load_specular(SCENES["slab"], backend="scalar", specular="mirrored")


def test_layout_and_the_analytic_renderer() -> None:
    layout = BufferLayout().adding(["chain_roughness", "throughput"])
    assert layout.names[-3:] == ("throughput", "chain_roughness", "emission")
    assert layout.input_channels == BufferLayout().input_channels + 4
    renderer = AnalyticRenderer(dimensions=1, patch_size=4, layout=layout)
    image = renderer.image_buffers(torch.zeros(1), resolution=4)
    assert (image[..., layout.slice("throughput")] == 1).all()
    assert (image[..., layout.slice("chain_roughness")] == 0).all()


def test_the_program_trains_on_traced_buffers(tmp_path) -> None:
    buffers = stored_buffers(tmp_path, "scene=mirror", "renderer.specular=traced")
    assert buffers[-2:] == ["throughput", "emission"]
