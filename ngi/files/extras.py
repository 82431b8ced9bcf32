"""Optional parts of the installation: what brings them here."""

import re
from importlib.metadata import requires
from pathlib import Path
from shlex import quote

from ngi.files.resources import root

DISTRIBUTION = "neural-global-illumination"

EXTRAS = {
    "denoise": "method=ours (but data=patches_without_camera) and path_tracing_oidn",
    "viewer": "ngi view and viewer=true",
    "video": "ngi video",
    "export": "ngi export",
}
"""Those that are asked for most, and what they are for."""


def install_command(extra: str) -> str:
    """The command that installs an extra, of a checkout or beside an installed wheel."""
    if (root() / "pyproject.toml").exists():
        here = Path() if root() == Path.cwd() else root()
        project = quote(f"{here}[{extra}]")
        return f"pip install -c {quote(str(here / 'constraints.txt'))} -e {project}"
    return f"pip install {' '.join(requirements(extra))}"


def requirements(extra: str) -> list[str]:
    """The packages of an extra as `pip install` takes them."""
    marker = re.compile(rf"""extra == ['"]{extra}['"]""")
    named = requires(DISTRIBUTION) or []
    return [each.partition(";")[0].strip() for each in named if marker.search(each)]
