"""The table of what frames of ours and of a denoiser take, from `ngi benchmark frames`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analysis.readme_table import markdown_row


def frames_table(figures: Sequence[Mapping[str, Any]]) -> str:
    """A row per scene and resolution, a column per part: medians, in ms but for the ratios.

    figures: those of the benchmark's JSON file; parts other than 'frames' are left out
    Raises ValueError where a scene lacks a part that another one has.
    """
    cells: dict[tuple[str, int], dict[str, str]] = {}
    for figure in figures:
        if figure["part"] == "frames":
            part, size = figure["name"].rsplit(", ", 1)
            row = cells.setdefault((figure["scene"], int(size.split()[0])), {})
            row[part] = f"{figure['median']:{',.0f' if figure['unit'] == 'ms' else '.2f'}}"
    parts = list(dict.fromkeys(part for row in cells.values() for part in row))
    lines = [["scene", "pixels", *parts], [":--", *["--:"] * (len(parts) + 1)]]
    for (scene, size), row in cells.items():
        if missing := [part for part in parts if part not in row]:
            raise ValueError(f"{scene}, {size} pixels: '{missing[0]}' was not measured")
        lines.append([scene, f"{size} × {size}", *(row[part] for part in parts)])
    return "\n".join(map(markdown_row, lines))
