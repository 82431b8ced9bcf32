"""Launches that do not fit: by closed formulas, and with Dr.Jit refusing memory."""

from __future__ import annotations

import logging

import numpy as np
import pytest
import torch

from ngi.machine.backend import dr, llvm_problem
from ngi.render import jit_tracer
from ngi.render.fitting import FittingTracer
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.render.tracing import PixelList, Window
from ngi.scene import read_scene

NO_MEMORY = "jit_malloc(): out of memory! Could not allocate 123 bytes (backend=CUDA, shared=0)."


class SmallTracer:
    """Refuses launches above `room` pixels x samples; a sample is a random number about its row."""

    def __init__(self, room: int, *, refusals: float = np.inf) -> None:
        self.room = room
        self.refusals = refusals
        self.launched: list[int] = []
        self.tried = 0

    def radiance(self, window, *, samples, seed):
        self._check(window.width * window.height * samples)
        noise = torch.rand(
            window.height,
            window.width,
            samples,
            3,
            generator=torch.Generator().manual_seed(seed),
            dtype=torch.float64,
        )
        return lambda: (noise.mean(dim=2) + rows(window)).float()

    def buffers(self, window, *, samples):
        if isinstance(window, PixelList):
            self._check(len(window.numbers) * samples)
            return lambda: window.numbers[:, None].expand(-1, 3).float()
        self._check(window.width * window.height * samples)
        return lambda: rows(window).expand(-1, window.width, 3).float()

    def _check(self, size: int) -> None:
        self.tried += 1
        if size > self.room and self.refusals > 0:
            self.refusals -= 1
            raise RuntimeError(NO_MEMORY)
        self.launched.append(size)


def rows(window: Window):
    return torch.arange(window.y, window.y + window.height).double()[:, None, None]


WINDOW = Window(3, 5, 6, 7, 40)


LIST = PixelList(torch.tensor([4, 1, 9, 9, 30]), 6)


def fitting(room, **options):
    inner = SmallTracer(room, **options)
    return inner, FittingTracer(inner, free=lambda: None)


def test_what_fits_is_left_alone() -> None:
    inner, tracer = fitting(10**6)
    expected = inner.radiance(WINDOW, samples=50, seed=1)()
    assert torch.equal(tracer.radiance(WINDOW, samples=50, seed=1)(), expected)
    assert (tracer.split, inner.launched) == (0, [2100, 2100])


@pytest.mark.parametrize("room", [10, 9, 4, 2])
def test_parts_make_the_whole_list(room) -> None:
    inner, tracer = fitting(room)
    expected = LIST.numbers[:, None].expand(-1, 3).float()
    assert torch.equal(tracer.buffers(LIST, samples=2)(), expected)
    assert sum(inner.launched) == 10
    assert max(inner.launched) <= room


def test_a_pixel_that_does_not_fit_is_said() -> None:
    _, tracer = fitting(1)
    with pytest.raises(RuntimeError, match="not even 1 pixels"):
        tracer.buffers(LIST, samples=2)


@pytest.mark.parametrize("room", [1500, 300, 42, 41, 20, 6])
def test_parts_make_the_whole(room, caplog) -> None:
    inner, tracer = fitting(room)
    with caplog.at_level(logging.WARNING):
        first = tracer.radiance(WINDOW, samples=50, seed=1)()
        again = tracer.radiance(WINDOW, samples=50, seed=1)()
    assert sum(inner.launched) == 2 * 2100, "every sample once"
    assert torch.equal(first, again)
    assert not torch.equal(first, tracer.radiance(WINDOW, samples=50, seed=2)())
    expected = rows(WINDOW).expand(-1, 6, 3).float() + 0.5
    deviation = (1 / 12 / 50) ** 0.5
    assert float((first - expected).abs().max()) < 5 * deviation
    assert float((first - expected).std()) == pytest.approx(deviation, rel=0.25)
    assert len(caplog.messages) == 1
    assert NO_MEMORY in caplog.messages[0]
    whole = SmallTracer(10**9).buffers(WINDOW, samples=1)()
    assert torch.equal(tracer.buffers(WINDOW, samples=1)(), whole)


def test_sizes_that_did_not_fit_are_not_tried_again() -> None:
    inner, tracer = fitting(300)
    tracer.radiance(WINDOW, samples=50, seed=1)
    tried = inner.tried
    inner.launched.clear()
    tracer.radiance(WINDOW, samples=50, seed=1)
    assert inner.tried - tried == len(inner.launched)
    assert tracer.split == 2 * (len(inner.launched) - 1)


def test_memory_is_given_back_before_anything_is_split(caplog) -> None:
    inner = SmallTracer(10, refusals=1)
    freed = []
    tracer = FittingTracer(inner, free=lambda: freed.append(1))
    whole = tracer.radiance(WINDOW, samples=50, seed=1)()
    assert torch.equal(whole, SmallTracer(10**6).radiance(WINDOW, samples=50, seed=1)())
    assert (freed, tracer.split, caplog.messages) == ([1], 0, [])


def test_the_smallest_part_says_what_to_lower() -> None:
    for launch in (
        lambda tracer: tracer.radiance(WINDOW, samples=8, seed=0),
        lambda tracer: tracer.buffers(WINDOW, samples=1),
    ):
        with pytest.raises(RuntimeError, match=r"6 pixels with one sample .* lower renderer\.work"):
            launch(fitting(5)[1])
    rays = r"6 pixels with 2 samples fit .* lower renderer\.buffer_samples, renderer\.workers"
    with pytest.raises(RuntimeError, match=rays):
        fitting(8)[1].buffers(WINDOW, samples=2)  # which are not split by rays


def test_other_errors_are_none_of_its_business() -> None:
    inner, tracer = fitting(10)
    inner._check = lambda _: (_ for _ in ()).throw(RuntimeError("another one"))
    with pytest.raises(RuntimeError, match="another one"):
        tracer.buffers(WINDOW, samples=1)
    assert tracer.split == 0


@pytest.fixture
def scarce(monkeypatch):
    """Dr.Jit gets memory for so many numbers at a time, in recordings too."""
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    evaluate = dr.eval
    room = [10**9]

    def scarcely(*values):
        if max((dr.width(value) for value in values), default=0) > room[0]:
            raise RuntimeError(NO_MEMORY)
        return evaluate(*values)

    monkeypatch.setattr(jit_tracer.dr, "eval", scarcely)
    return lambda numbers: room.__setitem__(0, numbers)


def test_mitsuba_renders_the_same_picture_in_parts(scarce, box_folder, caplog) -> None:
    def box():
        return MitsubaRenderer(
            scene=read_scene(box_folder), backend="llvm", patch_size=8, samples_per_pixel=64
        )

    plenty, little = box(), box()
    drawn = torch.Generator().manual_seed(0)
    states = torch.rand(12, plenty.dimensions + 2, generator=drawn)
    v = states[0, :-2]
    whole = plenty.render_patches(states, resolution=16, seed=3)
    image = plenty.render_image(v, resolution=16, samples_per_pixel=512, seed=5)
    scarce(8 * 8 * 16)
    with caplog.at_level(logging.WARNING):
        little.warm_up()
        parts = [little.render_patches(states, resolution=16, seed=3) for _ in range(2)]
        split = little.render_image(v, resolution=16, samples_per_pixel=512, seed=5)
    assert torch.equal(parts[0].log_radiance, parts[1].log_radiance)
    assert torch.equal(parts[0].buffers, whole.buffers)
    assert parts[0].paths == whole.paths
    assert not torch.equal(parts[0].log_radiance, whole.log_radiance)
    torch.testing.assert_close(split.mean(), image.mean(), rtol=0.03, atol=0)
    patches = torch.stack([each.log_radiance.expm1() for each in (parts[0], whole)])
    torch.testing.assert_close(patches[0].mean(), patches[1].mean(), rtol=0.06, atol=0)
    assert "pictures of this scene take longer" not in caplog.text
    assert len(caplog.messages) == 1, "once for patches and images"
    little.close()
    assert "traced in parts" in caplog.messages[-1]


def test_an_image_of_more_paths_than_dr_jit_can_number(load_box, monkeypatch) -> None:
    renderer = load_box("llvm", patch_size=8)
    traced = []

    def radiance(window, *, samples, seed):  # noqa: ARG001
        size = window.width * window.height * samples
        assert size <= 2**23
        traced.append(size)
        return lambda: torch.ones(window.height, window.width, 3)

    monkeypatch.setattr(renderer._tracer, "radiance", radiance)
    v = torch.full((renderer.dimensions,), 0.5)
    image = renderer.render_image(v, resolution=900, samples_per_pixel=10_000, seed=0)
    assert sum(traced) == 900 * 900 * 10_000 > 2**32
    assert torch.equal(image, torch.ones(900, 900, 3))
