"""The wheelhouse for a machine without network: what it holds, and what is left of a wheel."""

import base64
import hashlib
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from itertools import chain
from pathlib import Path

from packaging.requirements import Requirement

from ngi.machine.backend import VARIANTS
from ngi.studies.gpu_check.runs import FORMULAS, METHODS
from tools.wheelhouse import NEEDED, ROOT, USUAL, listed, trim

FILES = (
    *(f"mitsuba/{variant}.cpython-312.so" for variant in VARIANTS.values()),
    *("mitsuba/libmitsuba.so", "mitsuba/plugins/path.so", "mitsuba/data/ior/gold.spd"),
)
LEFT_OUT = (
    *("mitsuba/llvm_ad_spectral.cpython-312.so", "mitsuba/cuda_ad_mono_polarized.cpython-312.so"),
    *("mitsuba/scalar_spectral_polarized.cpython-312.so", "mitsuba/data/srgb.coeff"),
    *("mitsuba/plugins/sunsky.so", "mitsuba/plugins/timed_sunsky.so"),
)
RECORD = "mitsuba-3.dist-info/RECORD"


def wheel(path: Path) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.mkdir("mitsuba")
        lines = []
        for name in (*FILES, *LEFT_OUT):
            content = name.encode() * 3
            archive.writestr(name, content)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=")
            lines.append(f"{name},sha256={digest.decode()},{len(content)}\n")
        archive.writestr(RECORD, "".join([*lines, f"{RECORD},,\n"]))
    return path


def test_the_variants_that_this_program_chooses_are_kept_and_no_others(tmp_path: Path) -> None:
    made = wheel(tmp_path / "mitsuba-3.whl")
    assert listed(made)
    trim(made)
    with zipfile.ZipFile(made) as archive:
        assert set(archive.namelist()) == {"mitsuba/", *FILES, RECORD}
        assert archive.read(FILES[0]) == FILES[0].encode() * 3
    assert listed(made)


def test_a_wheel_whose_list_is_of_other_files_is_noticed(tmp_path: Path) -> None:
    made = wheel(tmp_path / "mitsuba-3.whl")
    with zipfile.ZipFile(made, "a") as archive:
        archive.writestr("mitsuba/more.so", b"")
    assert not listed(made)


def normalised(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


THAT_MACHINE = {"extra": "", "python_version": "3.12", "python_full_version": "3.12.1"}
"""Linux, too, but not this Python: the wheels are of CPython 3.12."""


def with_what_they_need(*names: str) -> set[str]:
    """Distributions, and all that these ask for there without an extra."""
    found: set[str] = set()
    waiting = [normalised(name) for name in names]
    while waiting:
        name = waiting.pop()
        try:
            wanted = map(Requirement, requires(name) or ())
        except PackageNotFoundError:  # what the machine has in its stead
            continue
        found.add(name)
        plain = (of for of in wanted if of.marker is None or of.marker.evaluate(THAT_MACHINE))
        asked = (normalised(of.name) for of in plain)
        waiting += [other for other in asked if other not in found]
    return found


WITHOUT_THE_OTHERS = """
import sys

class Without:
    def __init__(self, finder):
        self.finder = finder

    def __getattr__(self, name):
        return getattr(self.finder, name)

    def find_spec(self, name, path=None, target=None):
        return None if name in ABSENT else self.finder.find_spec(name, path, target)

ABSENT = set(sys.argv.pop(1).split(","))
sys.meta_path[:] = map(Without, sys.meta_path)
import ngi.commands.doctor
from ngi.studies.gpu_check.plan import Sizes, items
from ngi.train import main
main()
"""


THERE = with_what_they_need("torch", *USUAL) | {normalised(name) for name in NEEDED}


def test_what_is_packed_needs_nothing_else() -> None:
    again = {"pytorch-lightning"}  # the same as lightning, by its other name, which nobody imports
    assert with_what_they_need(*NEEDED) - THERE == again & with_what_they_need(*NEEDED)


def test_the_program_needs_none_of_its_other_libraries_on_a_gpu(tmp_path: Path) -> None:
    """The doctor, the check and a run of ours, where these can not be imported."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = [*project["dependencies"], *chain(*project["optional-dependencies"].values())]
    others = {normalised(line.partition("==")[0]) for line in asked} - THERE
    absent = [
        module
        for module, owners in packages_distributions().items()
        if others & {normalised(owner) for owner in owners}
    ]
    assert {"pandas", "wandb"} <= {*absent}
    options = (*FORMULAS, "method=ours", *METHODS["ours"], "budget.steps=6", "trainer=graphs")
    sizes = ("model.hidden_features=8", "model.hidden_layers=2")
    places = (f"run.folder={tmp_path / 'run'}", f"run.references={tmp_path}")
    command = [sys.executable, "-c", WITHOUT_THE_OTHERS, ",".join(absent)]
    subprocess.run([*command, *options, *sizes, *places], cwd=ROOT, check=True)
    assert (tmp_path / "run" / "result.json").exists()
