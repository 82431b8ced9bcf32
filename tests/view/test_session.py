"""What is made for a browser, and when: the newest wish only, first small, then whole."""

from dataclasses import replace
from functools import partial

from ngi.view.scene_view import Place
from ngi.view.screen import Screen
from ngi.view.session import MOST_SAMPLES, SETTLED, Job, Wish
from ngi.view.session import Session as Anyones


def halved(place: Place) -> Place:
    return replace(place, resolution=place.resolution // 2)


Session = partial(Anyones, preview=halved)


def wish(v: float = 0.5, *, resolution: int = 512, show: str = "network") -> Wish:
    return Wish(Place((v,), resolution), Screen(show))


def next_job(
    session: Anyones, *, now: float, samples: int = 0, computed: bool = False
) -> Job | None:
    return session.next_job(now=now, samples=samples, computed=computed)


def drain(session: Anyones, *, now: float) -> list[Job]:
    jobs = []
    while (job := next_job(session, now=now)) is not None and len(jobs) < 5:
        session.done(job)
        jobs.append(job)
    return jobs


def test_the_first_picture_is_whole_and_made_once() -> None:
    assert drain(Session(wish()), now=100) == [Job(wish())]


def test_while_something_moves_previews_are_made_then_the_whole() -> None:
    session = Session(wish())
    drain(session, now=100)
    session.change(wish(0.6), now=100)
    assert drain(session, now=100.01) == [Job(wish(0.6, resolution=256))]
    assert 0 < session.seconds_until_settled(now=100.01) < SETTLED
    assert drain(session, now=100 + SETTLED) == [Job(wish(0.6))]
    assert session.seconds_until_settled(now=101) == 0


def test_of_many_changes_only_the_last_is_made() -> None:
    session = Session(wish())
    for step in range(100):
        session.change(wish(step / 100), now=100)
    assert drain(session, now=100) == [Job(wish(0.99, resolution=256))]


def test_where_the_whole_is_quick_there_is_no_preview() -> None:
    session = Anyones(wish(), preview=lambda place: place)
    session.change(wish(0.6), now=0)
    assert drain(session, now=0) == [Job(wish(0.6))]
    assert drain(session, now=1) == []


def test_one_preview_is_enough_though_finer_ones_would_be_quick_by_now() -> None:
    previews = iter((64, 128, 256))
    session = Anyones(wish(), preview=lambda place: replace(place, resolution=next(previews)))
    session.change(wish(0.6), now=0)
    assert drain(session, now=0) == [Job(wish(0.6, resolution=64))]
    session.change(wish(0.7), now=0.1)
    assert drain(session, now=0.1) == [Job(wish(0.7, resolution=128))]


def test_a_path_traced_picture_gets_better_until_it_is_good() -> None:
    session = Session(wish(show="network | path tracer"))
    session.done(Job(session.wish))
    assert next_job(session, now=1, samples=8) == Job(session.wish, more_paths=True)
    assert next_job(session, now=1, samples=MOST_SAMPLES) is None
    session.change(wish(0.7, show="error"), now=2)
    assert next_job(session, now=2, samples=8) == Job(wish(0.7, resolution=256, show="error"))


def test_what_is_computed_already_is_shown_whole_at_once_and_better_once_nothing_moves() -> None:
    session = Session(wish(show="path tracer"))
    drain(session, now=1)
    brighter = Wish(session.wish.place, Screen("path tracer", exposure=1.0))
    session.change(brighter, now=2)
    assert next_job(session, now=2, samples=8, computed=True) == Job(brighter)
    session.done(Job(brighter))
    assert next_job(session, now=2, samples=8, computed=True) is None
    better = next_job(session, now=2 + SETTLED, samples=8, computed=True)
    assert better == Job(brighter, more_paths=True)


def test_what_is_shown_already_is_made_again_on_demand() -> None:
    session = Session(wish())
    assert drain(session, now=1) == [Job(wish())]
    session.change(wish(), now=1)
    assert drain(session, now=1) == []
    session.again()
    assert drain(session, now=2) == [Job(wish())]
