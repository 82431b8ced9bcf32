"""Files of the tests lie in memory, where there is room: 50,000 that nobody reads a second time.

On a disk that is told of every file that is deleted, or that a file has to reach before a run goes
on, they take minutes of `pytest`. Those of tests that failed are kept, as pytest does.
"""

import os
import shutil
import tempfile
from pathlib import Path

MEMORY = Path("/dev/shm")
ROOM = 4 * 2**30
"""Bytes that have to be free there; the tests' files are 0.7 GB."""


def use() -> None:
    """From now on, in this process and those that it starts; a TMPDIR that is set stays."""
    if "TMPDIR" in os.environ or not os.access(MEMORY, os.W_OK):
        return
    if shutil.disk_usage(MEMORY).free >= ROOM:
        os.environ["TMPDIR"] = str(MEMORY)
        tempfile.tempdir = None  # pytest has asked for it already
