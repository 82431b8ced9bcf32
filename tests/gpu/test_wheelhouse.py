"""The wheelhouse for a machine without network: what is left of Mitsuba's wheel."""

import base64
import hashlib
import zipfile
from pathlib import Path

from ngi.machine.backend import VARIANTS
from tools.wheelhouse import listed, trim

FILES = (
    *(f"mitsuba/{variant}.cpython-312.so" for variant in VARIANTS.values()),
    *("mitsuba/libmitsuba.so", "mitsuba/plugins/path.so", "mitsuba/data/ior/gold.spd"),
)
LEFT_OUT = (
    *("mitsuba/llvm_ad_spectral.cpython-312.so", "mitsuba/cuda_ad_mono_polarized.cpython-312.so"),
    *("mitsuba/scalar_spectral_polarized.cpython-312.so", "mitsuba/data/srgb.coeff"),
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
