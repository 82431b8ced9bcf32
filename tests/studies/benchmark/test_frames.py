from itertools import pairwise
from types import SimpleNamespace

import pytest

from ngi.machine.backend import llvm_problem
from ngi.methods.path_tracing.tracing import PathTracing
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.studies.benchmark import frames, viewer
from ngi.studies.benchmark.scenes import shipped

[MIRROR] = shipped(["mirror"])


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
def test_frames_take_as_long_as_their_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frames, "RESOLUTIONS", (24, 32))
    figures = frames.frames(MIRROR, repeats=1, seconds=60)
    assert len(figures) == 2 * 11
    for resolution, of_one in ((24, figures[:11]), (32, figures[11:])):
        assert all(f.name.endswith(f"{resolution} × {resolution}") for f in of_one)
        times, shares = ([f.median for f in part] for part in (of_one[:8], of_one[8:]))
        buffers, fewer, network, ours, paths, denoiser, denoised, fast_denoiser = times
        assert min(times) > 0
        assert ours == pytest.approx(buffers + network)
        assert denoised == pytest.approx(paths + denoiser)
        of_fewer, of_fast = (fewer + network) / denoised, ours / (paths + fast_denoiser)
        assert shares == pytest.approx([ours / denoised, of_fewer, of_fast])


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
def test_every_part_is_timed_on_every_hard_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """And on another one than the call before, so that nothing is kept from it."""
    calls = []

    class Counted(MitsubaRenderer):
        def image_buffers(self, v, *, resolution, samples=None):
            calls.append((samples, tuple(v.tolist())))
            return super().image_buffers(v, resolution=resolution, samples=samples)

    class Traced(PathTracing):
        def trace(self, v, *, resolution):
            calls.append(("paths", tuple(v.tolist())))
            return super().trace(v, resolution=resolution)

    monkeypatch.setattr(frames, "RESOLUTIONS", (24,))
    monkeypatch.setattr(frames, "MitsubaRenderer", Counted)
    monkeypatch.setattr(frames, "PathTracing", Traced)
    hard = {tuple(v.tolist()) for v in Counted(scene=MIRROR.read()).hard_frames()}
    frames.frames(MIRROR, repeats=len(hard) - 1, seconds=60)
    _, _, *calls = calls  # the network's buffers and the denoiser's image; one round warms up
    parts = [None, frames.FEWER_RAYS, "paths"]
    assert [part for part, _ in calls] == parts * len(hard)
    for part in parts:
        assert {v for of, v in calls if of == part} == hard
    assert all(before[1] != after[1] for before, after in pairwise(calls))


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
@pytest.mark.parametrize("camera", [slice(0, 0), slice(0, 1)])
def test_the_viewer_shows_pictures_while_a_slider_moves(
    monkeypatch: pytest.MonkeyPatch, camera: slice
) -> None:
    def with_camera(scene):
        made = frames.Ours.of(scene)
        made.renderer.camera_part = camera
        return made

    monkeypatch.setattr(viewer, "Ours", SimpleNamespace(of=with_camera))
    monkeypatch.setattr(viewer, "RESOLUTION", 64)
    monkeypatch.setattr(viewer, "WARM_UP", 0.5)
    figures = viewer.viewer(MIRROR, seconds=2.0)
    moving = ["the camera moves", "something else moves"][1 - camera.stop :]
    assert [f.name.partition(", ")[2] for f in figures[::3]] == moving
    for rate, pixels, rays in (figures[first : first + 3] for first in range(0, len(figures), 3)):
        assert 1 < rate.median <= 60  # of 60 positions a second none is shown twice
        assert rate.limit == "≥ 10"
        assert pixels.median == 64  # no fewer are ever shown
        assert 3 <= rays.median <= 16


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
def test_the_network_is_that_of_a_run() -> None:
    """Which is not told where the camera is: the buffers say it."""
    [scene] = shipped(["veach-egg"])
    made = frames.Ours.of(scene)
    camera = range(made.renderer.dimensions)[made.renderer.camera_part]
    assert len(camera) > 0
    seen = made.renderer.dimensions - len(camera)
    assert made.samples.network_arguments["scene_dimensions"] == seen
    v = made.renderer.hard_frames()[0]
    buffers = made.renderer.image_buffers(v, resolution=16)
    assert made.predict(buffers, v).shape == (16, 16, 3)
    assert made.size == "6x128"
