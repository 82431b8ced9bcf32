"""A study's folder belongs to runs that are made alike."""

import json
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ngi.files.code_versions import code_version, same_program, shown
from ngi.files.durable import write_atomically
from ngi.machine.provenance import provenance

log = logging.getLogger(__name__)

PROVENANCE = "provenance.json"


def claim(folder: Path, made_with: Mapping[str, Any], *, backend: str, option: str) -> None:
    """Writes what the folder's runs are made with, or compares it with that of the runs before.

    Runs of another version of the code are no error: all versions are kept, with a warning.

    made_with: by name, what decides about all runs, plain data; a name may be added later
    backend: the renderer's description. option: that chooses another folder
    Raises ValueError where they differ.
    """
    file = folder / PROVENANCE
    found = json.loads(file.read_text()) if file.exists() else provenance(backend=backend)
    for key, value in made_with.items():
        if found.setdefault(key, value) != json.loads(json.dumps(value)):
            raise ValueError(
                f"{file}: the runs in this folder were made with a different {key}; give "
                f"another {option}, or move the folder away"
            )
    commits, version = found.setdefault("commits", []), code_version()
    if not (commits and same_program(commits[-1], version)):
        if commits:
            log.warning(
                "%s: resumes with %s; the earlier results were made with %s. If the computation "
                "has changed in between, give another %s",
                *(folder, shown(version), shown(commits[-1]), option),
            )
        commits.append(version)
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(file, json.dumps(found, indent=1).encode())
