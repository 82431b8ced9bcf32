"""The code blocks of the documentation."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(\w+)(?: title=\"([^\"]+)\")?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
LONG = "minutes"
"""Title of a block whose commands take too long for a test."""


@dataclass(frozen=True)
class Block:
    """language: 'sh' for commands; title: a file's name, or `LONG`; None where there is none."""

    language: str
    title: str | None
    text: str

    @property
    def is_file(self) -> bool:
        return self.title is not None and "." in self.title and self.language != "text"


def blocks(page: Path) -> list[Block]:
    found = [Block(*match.groups()) for match in BLOCK.finditer(page.read_text())]
    assert len(found) == page.read_text().count("\n```") // 2, f"{page}: blocks that cannot be read"
    return found


def commands(page: Path) -> Iterator[str]:
    """The lines of all blocks of commands, without comments."""
    for block in blocks(page):
        if block.language == "sh":
            for line in block.text.splitlines():
                if command := re.split(r"(?:^|\s)#", line)[0].strip():
                    yield command
