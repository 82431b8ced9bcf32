"""The JSON file of a check, written after every item, and the page that shows it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ngi.files.durable import damage_named, write_atomically
from ngi.studies.benchmark.figures import Figure
from ngi.studies.benchmark.tables import markdown
from ngi.studies.gpu_check.item import Entry, Item, Outcome

MOST_BEGINNINGS = 2
"""Of an item that never came to an end: the process was killed in it, or crashed, each time."""


class Record:
    """What is known so far.

    folder: of the JSON file and the page
    about: where the figures are from, as `ngi.machine.provenance` says; kept with every item
    Raises ValueError for a damaged file.
    """

    def __init__(self, folder: Path, *, about: dict[str, Any]) -> None:
        self.path = folder / "gpu-check.json"
        self.page = folder / "gpu-check.md"
        self._about = about
        self._entries: dict[str, Entry] = {}
        if self.path.exists():
            with damage_named(self.path, "delete it"):
                self._entries = json.loads(self.path.read_text())["items"]

    def to_do(self, items: Sequence[Item]) -> list[Item]:
        """Those without figures. One that failed is tried again; one that crashes is not."""
        return [item for item in items if not self._is_over(item)]

    def failed(self, items: Sequence[Item]) -> dict[str, str]:
        """By item, why: those that raised, and those that are not begun again after crashes."""
        entries = {item.key: self._entries.get(item.key, {}) for item in items}
        return {
            key: entry.get("failure") or _why(entry)
            for key, entry in entries.items()
            if "failure" in entry or _crashes(entry)
        }

    def begin(self, item: Item) -> None:
        """Before it is measured, so that a crash is not tried for ever."""
        begun = self._entries.get(item.key, {}).get("begun", 0)
        self._keep(item, {"begun": 0 if item.goes_on else begun + 1})

    def done(self, item: Item, outcome: Outcome) -> None:
        """It came to an end."""
        figures = [asdict(replace(f, part=_part(item, f))) for f in outcome.figures]
        self._keep(item, {"figures": figures, "notes": outcome.notes, **self._about})

    def fail(self, item: Item, error: Exception) -> None:
        """It raised."""
        self._keep(item, {"failure": f"{type(error).__name__}: {error}", **self._about})

    def cut_off(self, item: Item) -> None:
        """It goes on next time."""
        self._keep(item, {})

    def write_page(self, items: Sequence[Item]) -> None:
        """The page, of everything that is known of these items."""
        self.page.write_text(page(items, self._entries, about=self._about))

    def _is_over(self, item: Item) -> bool:
        entry = self._entries.get(item.key, {})
        return "figures" in entry or _crashes(entry)

    def _keep(self, item: Item, entry: Entry) -> None:
        self._entries[item.key] = entry
        self.path.parent.mkdir(parents=True, exist_ok=True)
        content = {"about": self._about, "items": self._entries}
        write_atomically(self.path, json.dumps(content, indent=2).encode())


def page(items: Sequence[Item], entries: dict[str, Entry], *, about: dict[str, Any]) -> str:
    """Markdown: the machine, the figures stage by stage, and what is missing."""
    figures: list[Figure] = []
    notes: list[str] = []
    missing: list[str] = []
    for item in items:
        entry = entries.get(item.key, {})
        figures += [Figure(**figure) for figure in entry.get("figures", ())]
        notes += [f"- {item.key}: {note}" for note in entry.get("notes", ())]
        if "figures" in entry and entry["commit"] != about["commit"]:
            notes.append(f"- {item.key}: measured at commit {entry['commit']}")
        if "figures" not in entry:
            missing.append(f"- {item.key}: {_why(entry)}")
    machine, versions = about["machine"], about["versions"]
    parts = [
        f"# GPU check: {machine['gpu'] or machine['processor']}",
        f"{machine['backend']}; PyTorch {versions['torch']}; commit {about['commit']}"
        f"{', changed since' if about['dirty'] else ''}. Medians with quartiles.",
    ]
    parts += [markdown(figures)] if figures else []
    parts += ["### Notes", "\n".join(notes)] if notes else []
    parts += ["### Missing", "\n".join(missing)] if missing else []
    return "\n\n".join(parts) + "\n"


def _part(item: Item, figure: Figure) -> str:
    """Its stage, and the part of it that the figure names."""
    return ": ".join(filter(None, (item.stage, figure.part)))


def _crashes(entry: Entry) -> bool:
    return bool(entry.get("begun", 0) >= MOST_BEGINNINGS)


def _why(entry: Entry) -> str:
    if "failure" in entry:
        return str(entry["failure"]).splitlines()[0]
    if _crashes(entry):
        return f"begun {entry['begun']} times and never ended; delete its entry to try again"
    return "not measured yet"
