"""Pictures that the viewer shows while a slider moves."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic, sleep

import numpy as np

from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.frames import Ours
from ngi.studies.benchmark.scenes import Scene
from ngi.view.scene_view import Place
from ngi.view.screen import Screen
from ngi.view.session import Wish
from ngi.view.studio import Shown, Studio

RESOLUTION = 256
"""Pixels a side that are asked for."""
MOVES = 60
"""Positions of the slider per second."""
WARM_UP = 3.0
"""Seconds until kernels are compiled and the viewer knows how long pictures take."""


def viewer(scene: Scene, *, seconds: float) -> list[Figure]:
    """Pictures per second, and how fine they are, while a variable goes to and fro.

    That is the first that places the camera, if any, and the first of all others: then photons are
    traced anew for each picture. Of the way to the browser nothing is measured.
    """
    shown = Ours.of(scene)
    dimensions = range(shown.renderer.dimensions)
    camera = dimensions[shown.renderer.camera_part]
    others = [number for number in dimensions if number not in camera]
    made = []
    for name, moving in (("the camera moves", camera[:1]), ("something else moves", others[:1])):
        for component in moving:
            made += _while_moving(name, component, shown, seconds=seconds / 2)
    return made


def _while_moving(name: str, component: int, made: Ours, *, seconds: float) -> list[Figure]:
    renderer = made.renderer
    studio = Studio(
        renderer=renderer,
        predict=lambda *given, preview: made.predict(*given, preview=preview).float(),
    )
    first = renderer.hard_frames()[0].tolist()

    def wish(moves: int) -> Wish:
        place = abs(moves % (2 * MOVES) - MOVES) / MOVES
        v = (*first[:component], place, *first[component + 1 :])
        return Wish(Place(v, RESOLUTION), Screen())

    pictures: list[tuple[float, Place]] = []

    def shown(picture: Shown) -> None:
        pictures.append((monotonic(), picture.view.place))

    def failed(error: Exception) -> None:
        raise error

    studio.open(0, wish(0), shown, failed)
    studio.work(wait=1)  # compiles
    with _moving(lambda moves: studio.change(0, wish(moves))):
        begin = monotonic() + WARM_UP
        while monotonic() < begin + seconds:
            studio.work(wait=0.1)
    times, places = zip(*(each for each in pictures if each[0] >= begin), strict=True)
    rays = [place.rays or renderer.buffer_samples for place in places]
    return [
        figure(f"pictures per second, {name}", (1 / np.diff(times)).tolist(), "1/s", "≥ 10"),
        figure(f"pixels a side, {name}", [place.resolution for place in places], "pixels"),
        figure(f"rays per pixel, {name}", rays, "rays"),
    ]


@contextmanager
def _moving(move: Callable[[int], None]) -> Iterator[None]:
    """Calls it `MOVES` times a second meanwhile, with 1, 2, 3 and so on."""
    stopped = threading.Event()

    def hand() -> None:
        moves = 0
        while not stopped.is_set():
            moves += 1
            move(moves)
            sleep(1 / MOVES)

    thread = threading.Thread(target=hand, daemon=True)
    thread.start()
    try:
        yield
    finally:
        stopped.set()
        thread.join()
