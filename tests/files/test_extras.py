import shlex
import tomllib
from pathlib import Path

import pytest

from ngi.files import extras
from ngi.files.extras import EXTRAS, install_command, requirements
from ngi.files.resources import root

with (root() / "pyproject.toml").open("rb") as file:
    DECLARED = tomllib.load(file)["project"]["optional-dependencies"]


@pytest.mark.parametrize("extra", DECLARED)
def test_the_packages_of_an_extra_are_those_that_are_declared(extra: str) -> None:
    found = [each.lower() for each in requirements(extra)]  # as metadata has names
    assert found == sorted(each.lower() for each in DECLARED[extra])


def test_a_checkout_installs_itself_and_a_wheel_the_packages(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    checkout = extras.root()
    monkeypatch.chdir(checkout)
    assert install_command("viewer") == "pip install -c constraints.txt -e '.[viewer]'"
    monkeypatch.chdir(tmp_path)
    told = shlex.split(install_command("viewer"))
    assert told == f"pip install -c {checkout}/constraints.txt -e {checkout}[viewer]".split()
    monkeypatch.setattr(extras, "root", lambda: tmp_path)
    assert install_command("viewer") == f"pip install {DECLARED['viewer'][0]}"
    assert install_command("export") == f"pip install {' '.join(sorted(DECLARED['export']))}"


def test_what_is_asked_for_most_is_there_to_be_installed() -> None:
    assert EXTRAS.keys() <= DECLARED.keys()
