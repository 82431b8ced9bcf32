"""The words of a command line, before Hydra reads them.

Where they name neither method nor budget, ours is trained, at a size that suits this machine:
`ngi train scene=X budget.seconds=60` gives the best network that it can train in that time. A
method, an experiment, a sweep or another budget, once named, is taken at its word.
"""

from __future__ import annotations

from collections.abc import Sequence

OURS = ("budget=machine", "method=ours")
"""What is added to the words."""

CHOOSING = ("method", "experiment", "sweeps", "path_tracing")
"""Groups whose choice says what is trained."""


def completed(words: Sequence[str]) -> list[str]:
    """The words of a command line, with `OURS` where they leave method and budget open."""
    named = {
        word.partition("=")[0].lstrip("+~"): word.partition("=")[2]
        for word in words
        if "=" in word and not word.startswith("-")
    }
    if named.get("budget", "machine") != "machine" or any(group in named for group in CHOOSING):
        return list(words)
    return with_overrides(words, *(word for word in OURS if word.split("=")[0] not in named))


def with_overrides(words: Sequence[str], *overrides: str) -> list[str]:
    """Hydra's command line with further overrides, before all others: those that follow win.

    Overrides have to stand together, which argparse asks for.
    """
    are_overrides = ("=" in word and word[0] != "-" for word in words)
    first = next((i for i, is_override in enumerate(are_overrides) if is_override), len(words))
    return [*words[:first], *overrides, *words[first:]]
