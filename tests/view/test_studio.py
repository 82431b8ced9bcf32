"""Pictures for several browsers, from closed formulas: the same numbers as without a viewer."""

from threading import Thread, get_ident
from time import monotonic, sleep

import numpy as np
import pytest
import torch
from torch import Tensor

from ngi.evaluate.pictures import srgb_picture
from ngi.render import AnalyticRenderer
from ngi.view import session
from ngi.view.scene_view import PASS_SAMPLES, Place, SceneView
from ngi.view.screen import Screen
from ngi.view.session import SETTLED, Wish
from ngi.view.studio import KEPT, Shown, Studio

V = (0.2, 0.5, 0.8)


def predict(buffers: Tensor, scene_vector: Tensor, *, preview: bool = False) -> Tensor:  # noqa: ARG001
    return torch.log1p(buffers[..., :3].abs() * (1 + scene_vector[0]))


def renderer(noise: float = 0.0) -> AnalyticRenderer:
    return AnalyticRenderer(dimensions=3, patch_size=16, noise=noise)


def fail(error: Exception) -> None:
    raise error


def settled(studio: Studio) -> None:
    sleep(SETTLED)
    for _ in range(20):  # of path-traced pictures there are always better ones
        if not studio.work(wait=0):
            return


def test_the_picture_is_the_one_computed_without_a_viewer() -> None:
    pictures: list[Shown] = []
    studio = Studio(renderer=renderer(), predict=predict)
    studio.open("a", Wish(Place(V, 40), Screen(exposure=1.0)), pictures.append, fail)
    assert studio.waiting
    assert studio.work(wait=0)
    assert not studio.waiting
    assert not studio.work(wait=0)
    v = torch.tensor(V)
    expected = torch.expm1(predict(renderer().image_buffers(v, resolution=40), v))
    np.testing.assert_array_equal(pictures[0].pixels, srgb_picture(expected, 1.0))
    assert pictures[0].full
    assert set(pictures[0].view.seconds) == {"buffers", "network"}


def test_more_passes_make_less_noise() -> None:
    view, v = SceneView(Place(V, 32), renderer(noise=0.5), predict), torch.tensor(V)
    truth = renderer().render_image(v, resolution=32, samples_per_pixel=1, seed=0)
    first = (view.reference - truth).std().item()
    for _ in range(15):
        view.trace()
    assert view.samples == 16 * PASS_SAMPLES
    assert (view.reference - truth).std().item() == pytest.approx(first / 4, rel=0.15)


def test_pixels_that_are_not_finite_are_left_out_of_the_mean() -> None:
    class Spotted(AnalyticRenderer):
        def render_image(self, *arguments: Tensor, **options: int) -> Tensor:
            image = super().render_image(*arguments, **options)  # type: ignore[arg-type]
            if options["seed"] == 0:
                image[0, 0] = torch.nan
            return image

    view = SceneView(Place(V, 32), Spotted(dimensions=3, patch_size=16), predict)
    view.trace()
    assert view.reference[0, 0].isnan().all()
    view.trace()
    assert view.reference.isfinite().all()
    assert view.noise is not None
    assert view.noise[0, 0].tolist() == [0, 0, 0]


def test_browsers_take_turns_and_new_pictures_come_before_better_ones() -> None:
    order: list[tuple[str, int]] = []
    studio = Studio(renderer=renderer(), predict=predict)
    for name, show in (("a", "path tracer"), ("b", "path tracer"), ("c", "network")):
        studio.open(
            name,
            Wish(Place(V, 32), Screen(show)),
            lambda made, name=name: order.append((name, made.view.samples)),  # type: ignore[misc]
            fail,
        )
    for _ in range(5):
        studio.work(wait=0)
    assert [name for name, _ in order] == ["a", "b", "c", "a", "b"]
    assert [samples for _, samples in order] == [8, 8, 8, 16, 24]  # one place, seen by two


def test_a_browser_that_is_gone_gets_nothing() -> None:
    pictures: list[Shown] = []
    studio = Studio(renderer=renderer(), predict=predict)
    studio.open("a", Wish(Place(V, 32), Screen()), pictures.append, fail)
    studio.close("a")
    studio.change("a", Wish(Place(V, 64), Screen()))
    assert not studio.work(wait=0)
    assert pictures == []


def test_waiting_ends_when_something_is_wanted() -> None:
    studio = Studio(renderer=renderer(), predict=predict)
    pictures: list[Shown] = []
    opening = Thread(
        target=lambda: (
            sleep(0.2),
            studio.open("a", Wish(Place(V, 32), Screen()), pictures.append, fail),
        )
    )
    begin = monotonic()
    opening.start()
    assert studio.work(wait=60)
    assert monotonic() - begin < 30
    opening.join()


def test_no_backlog_of_pictures_while_a_slider_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "MOVING", 0)  # as on a slow machine
    pictures: list[Shown] = []
    studio = Studio(renderer=renderer(), predict=predict)
    studio.open("a", Wish(Place(V, 256), Screen()), pictures.append, fail)
    studio.work(wait=0)
    for step in range(50):
        studio.change("a", Wish(Place((step / 50, 0.5, 0.8), 256), Screen()))
    studio.work(wait=0)
    settled(studio)
    assert [made.view.place.resolution for made in pictures] == [256, 64, 256]
    assert pictures[-1].view.place.v[0] == 0.98
    assert [made.full for made in pictures] == [True, False, True]


@pytest.mark.parametrize(
    ("before", "after", "whole"),
    [
        ("network", "network", True),
        ("network", "albedo", True),
        ("network | path tracer", "error", True),
        ("albedo", "network", False),
        ("network", "path tracer", False),
        ("path tracer", "network | path tracer", False),
    ],
)
def test_another_look_at_what_is_computed_is_whole_at_once(
    monkeypatch: pytest.MonkeyPatch, before: str, after: str, whole: bool
) -> None:
    monkeypatch.setattr(session, "MOVING", 0)  # as on a slow machine
    monkeypatch.setattr(session, "SETTLED", 60)
    pictures: list[Shown] = []
    studio = Studio(renderer=renderer(), predict=predict)
    place = Place(V, 128)
    studio.open("a", Wish(place, Screen(before)), pictures.append, fail)
    studio.work(wait=0)
    studio.change("a", Wish(place, Screen(after, curve="filmic", exposure=1.0)))
    assert studio.work(wait=0)
    assert pictures[1].full == whole
    assert (pictures[1].view is pictures[0].view) == whole
    assert not studio.work(wait=0)  # more paths would make the next look wait


def test_a_network_that_has_learnt_is_shown_again() -> None:
    factor = [1.0]
    pictures: list[Shown] = []
    studio = Studio(renderer=renderer(), predict=lambda b, v, **_: predict(b, v) * factor[0])
    studio.open("a", Wish(Place(V, 32), Screen()), pictures.append, fail)
    studio.work(wait=0)
    factor[0] = 0.5
    assert not studio.work(wait=0)
    studio.network_changed()
    assert studio.work(wait=0)
    assert (pictures[1].pixels != pictures[0].pixels).any()
    assert pictures[1].view is pictures[0].view  # its buffers and paths are kept


@pytest.mark.parametrize("show", ["network", "path tracer", "network | path tracer"])
def test_a_picture_that_fails_is_told_once_and_the_next_one_made(
    show: str, caplog: pytest.LogCaptureFixture
) -> None:
    class Broken(AnalyticRenderer):
        def image_buffers(self, v: Tensor, **options: int | None) -> Tensor:
            return super().image_buffers(small_enough(v), **options)  # type: ignore[arg-type]

        def render_image(self, v: Tensor, **options: int) -> Tensor:
            return super().render_image(small_enough(v), **options)

    def small_enough(scene_vector: Tensor) -> Tensor:
        if scene_vector[0] > 0.5:
            raise RuntimeError("out of memory")
        return scene_vector

    pictures: list[Shown] = []
    told: list[Exception] = []
    studio = Studio(renderer=Broken(dimensions=3, patch_size=16), predict=predict)
    studio.open("a", Wish(Place((0.9, 0, 0), 32), Screen(show)), pictures.append, told.append)
    settled(studio)
    assert [str(error) for error in told] == ["out of memory"]
    assert "the viewer could not make a picture" in caplog.text
    studio.change("a", Wish(Place(V, 32), Screen()))
    settled(studio)
    assert pictures[-1].full
    assert len(told) == 1
    studio.change("a", Wish(Place((0.9, 0, 0), 32), Screen(show)))
    settled(studio)
    assert len(told) == 2  # tried again, once


def test_errands_are_done_where_pictures_are_made() -> None:
    studio = Studio(renderer=renderer(), predict=predict)
    done: list[int] = []
    told: list[Exception] = []
    asking = Thread(
        target=lambda: (
            studio.ask(lambda: done.append(get_ident()), fail),
            studio.ask(lambda: done.append(1 // 0), told.append),
        )
    )
    asking.start()
    asking.join()
    assert done == []
    assert studio.waiting
    assert studio.work(wait=0)
    assert studio.work(wait=0)
    assert not studio.waiting
    assert done == [get_ident()]
    assert len(told) == 1


def test_what_one_browser_looks_at_another_does_not_push_out() -> None:
    clean: list[Shown] = []
    studio = Studio(renderer=renderer(), predict=predict)
    studio.open("a", Wish(Place(V, 32), Screen("path tracer")), clean.append, fail)
    studio.work(wait=0)
    seen = Place((0.2, 0.2, 0.2), 32)
    studio.open("c", Wish(seen, Screen()), [].append, fail)
    studio.work(wait=0)
    traced = Place((0.1, 0.1, 0.1), 32)
    studio.open("b", Wish(traced, Screen("path tracer")), [].append, fail)
    while studio._views.get(traced) is None or studio._views[traced].samples <= PASS_SAMPLES:
        studio.work(wait=0)
    for step in range(2 * KEPT):
        studio.open("b", Wish(Place((step / 99, 0, 0), 32), Screen()), [].append, fail)
        studio.work(wait=0)
    assert len(studio._views) == KEPT
    assert seen in studio._views
    assert traced in studio._views  # which is dearer than pictures of the network
    before, samples = clean[-1].view, clean[-1].view.samples
    studio.work(wait=0)
    assert clean[-1].view is before
    assert before.samples == samples + PASS_SAMPLES


def test_only_some_views_are_kept() -> None:
    pictures: list[Shown] = []
    studio = Studio(renderer=renderer(), predict=predict)
    for step in range(2 * KEPT):
        studio.open("a", Wish(Place((step / 99, 0, 0), 32), Screen()), pictures.append, fail)
        studio.work(wait=0)
    assert len(studio._views) == KEPT


def test_a_preview_asks_the_renderer_for_as_few_rays_as_its_place_says() -> None:
    asked: list[int | None] = []

    class Listening(AnalyticRenderer):
        def image_buffers(self, *arguments: Tensor, **options: int | None) -> Tensor:
            asked.append(options["samples"])
            return super().image_buffers(*arguments, **options)  # type: ignore[arg-type]

    for rays in (None, 4):
        view = SceneView(Place(V, 32, rays), Listening(dimensions=3, patch_size=16), predict)
        assert view.buffers.shape[0] == 32
    assert asked == [None, 4]
