"""Reads bad scene files and damaged runs, and says where that goes wrong."""

from __future__ import annotations

import signal
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random

from ngi.scene import SceneDescription, read_scene
from ngi.scene.release import read_release
from tests.fuzz.mutations import mutated
from tests.fuzz.runs import RUN_FILES, damaged, read_damaged
from tests.fuzz.seeds import RELEASES, SCENES, XML, write_seed

LONGEST = 5.0
"""Seconds that reading one may take."""


@dataclass(frozen=True)
class Bug:
    """number: of the input; what: an exception that is no message for users, or a hang."""

    number: int
    kind: str
    text: bytes
    what: str

    @property
    def place(self) -> str:
        """The same for the same bug."""
        lines = self.what.splitlines()
        ours = [line.strip() for line in lines if "ngi/" in line or "analysis/" in line]
        return f"{self.kind}: {ours[-1] if ours else ''}: {lines[-1][:150]}"


def make_input(number: int) -> tuple[str, bytes]:
    """What file the input is, 'scene.yaml', 'scene.xml', 'release', one of a run; and its text."""
    random = Random(number)
    kind = random.choice(("scene.yaml", "scene.yaml", "scene.xml", "release", "release", "run"))
    if kind == "run":
        kind = random.choice(RUN_FILES)
        return kind, damaged(random, kind)
    seeds = {"scene.yaml": SCENES, "scene.xml": (XML.encode(),), "release": RELEASES}[kind]
    return kind, mutated(random, random.choice(seeds), xml=kind != "scene.yaml")


def fuzz(
    numbers: range,
    folder: Path,
    *,
    use: Callable[[SceneDescription], object] = lambda _: None,
    longest: float = LONGEST,
) -> Iterator[Bug]:
    """Reads the inputs of these numbers in a folder of theirs.

    use: what is done with those that can be read; raises ValueError or OSError too.
    """
    write_seed(folder)
    for number in numbers:
        kind, text = make_input(number)
        what = read_one(folder, kind, text, use=use, longest=longest)
        if what is not None:
            yield Bug(number, kind, text, what)


def read_one(
    folder: Path,
    kind: str,
    text: bytes,
    *,
    use: Callable[[SceneDescription], object] = lambda _: None,
    longest: float = LONGEST,
) -> str | None:
    """What is wrong with how one input is read; None where it is read, or refused as it should."""
    try:
        with _at_most(longest), warnings.catch_warnings():
            warnings.simplefilter("error")
            if kind in RUN_FILES:
                read_damaged(folder, kind, text)
            else:
                use(_read_scene(folder, kind, text))
    except (ValueError, OSError) as error:
        if type(error) in (ValueError, FileNotFoundError) and str(folder) in str(error):
            return None if len(str(error)) < 20_000 else f"a message of {len(str(error))} letters"
        return traceback.format_exc()
    except BaseException:
        return traceback.format_exc()
    return None


def _read_scene(folder: Path, kind: str, text: bytes) -> SceneDescription:
    (folder / "scene.xml").write_text(XML)
    (folder / "scene.yaml").write_bytes(SCENES[0])
    (folder / ("scene.xml" if kind == "release" else kind)).write_bytes(text)
    return read_release(folder) if kind == "release" else read_scene(folder)


@contextmanager
def _at_most(seconds: float) -> Iterator[None]:
    def late(*_: object) -> None:
        raise TimeoutError(f"more than {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
