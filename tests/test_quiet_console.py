"""Libraries do not write on the console what nobody here can use."""

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    "imports", ["import ngi.evaluate.pictures", "import analysis, matplotlib.pyplot"]
)
def test_matplotlib_is_quiet_in_a_home_that_cannot_be_written_to(imports: str) -> None:
    known = {key: value for key, value in os.environ.items() if not key.startswith("MPL")}
    code = f"import logging; logging.basicConfig(level=logging.INFO); {imports}"
    answer = subprocess.run(
        [sys.executable, "-c", code],
        env={**known, "HOME": "/proc/nowhere", "XDG_CONFIG_HOME": "", "XDG_CACHE_HOME": ""},
        capture_output=True,
        text=True,
    )
    assert answer.returncode == 0
    assert answer.stderr == ""
