"""Readable folder names for runs, from what the command line changed."""

from __future__ import annotations

import hashlib
import re

LONGEST = 100
"""Characters; longer names are cut, and told apart by a hash."""


def run_name(overrides: str | None) -> str:
    """'sampler=uniform,model.hidden_features=64' as a folder name; 'default' for no override."""
    name = re.sub(r"[^\w.,=+-]+", "_", (overrides or "").replace("+", "")).strip("_,")
    if not name:
        return "default"
    if len(name) <= LONGEST:
        return name
    return f"{name[:LONGEST]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
