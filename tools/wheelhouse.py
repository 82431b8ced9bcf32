"""Packs what this program needs beside a machine's own CUDA PyTorch, for a machine without network.

    python tools/wheelhouse.py FOLDER [--python 3.12] [--llvm /usr/lib/…/libLLVM.so]

Downloads the wheels for that Python, at the versions of constraints.txt, without PyTorch and what
comes with it; takes out of Mitsuba the variants that this program never chooses; adds a libLLVM for
machines without OptiX; and says how much all of it is. There, in a checkout of this program:

    python -m pip install --no-index --no-deps FOLDER/*.whl
    xz -dk FOLDER/libLLVM.so.xz && export DRJIT_LIBLLVM_PATH=FOLDER/libLLVM.so
    export PYTHONPATH=$PWD && python -m ngi doctor

What libLLVM itself is linked with (`ldd` says it) has to be there. `ngi doctor` says which of the
driver's libraries Mitsuba lacks there. The program itself is not installed: it would fetch what
builds it, and pins another PyTorch.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import lzma
import re
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
MEGABYTES = 60
NEEDED = (
    *("mitsuba", "drjit", "lightning", "lightning-utilities", "torchmetrics", "hydra-core"),
    *("omegaconf", "antlr4-python3-runtime", "PyYAML", "packaging", "tqdm", "lpips", "pydantic"),
    *("pydantic_core", "annotated-types", "typing-inspection", "tabulate"),
)
"""What PyTorch does not bring. Left out are trimesh, which only reads the authors' scenes, and Open
Image Denoise, 87 MB, which method=ours denoises with (`data=patches_without_camera` does not)."""
USUAL = ("numpy", "scipy", "matplotlib", "pillow", "torchvision")
"""Too large, and on nearly every machine that trains; said, where the wheelhouse is used."""
PLATFORMS = ("manylinux_2_28_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64", "any")
UNUSED = re.compile(
    r"mitsuba/(\w+_(mono|spectral)(_polarized)?\.|data/(srgb\.coeff|sunsky/)|plugins/\w*sunsky\.)"
)
"""Of Mitsuba's wheel: this program renders in RGB, and no scene of it has a measured sky."""


def main() -> int:
    """Exit status 1 where all of it is more than `MEGABYTES`."""
    chosen = _arguments()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    download(chosen.folder, python=chosen.python)
    for wheel in chosen.folder.glob("*.whl"):
        trim(wheel)
        if not listed(wheel):
            raise RuntimeError(f"{wheel}: its files are not those of its list")
    if chosen.llvm is not None:
        packed = lzma.compress(chosen.llvm.read_bytes(), preset=9)
        (chosen.folder / "libLLVM.so.xz").write_bytes(packed)
    files = sorted(chosen.folder.iterdir(), key=lambda file: -file.stat().st_size)
    for file in files:
        print(f"{file.stat().st_size / 1e6:6.1f} MB  {file.name}")
    total = sum(file.stat().st_size for file in files) / 1e6
    print(f"{total:6.1f} MB  together, of {MEGABYTES}; to be there already: {', '.join(USUAL)}")
    return int(total > MEGABYTES)


def download(folder: Path, *, python: str) -> None:
    """The wheels; those that are published as sources only are made here."""
    versions = dict(
        line.split("==") for line in (ROOT / "constraints.txt").read_text().split() if "==" in line
    )
    known = {name.lower(): version for name, version in versions.items()}
    wanted = [f"{name}=={known[name.lower()]}" for name in NEEDED]
    sources = [entry for entry in wanted if entry.startswith("antlr4")]
    pip = [sys.executable, "-m", "pip"]
    options = ["--quiet", "--no-deps", "--python-version", python, "--only-binary=:all:"]
    for platform in PLATFORMS:
        options += ["--platform", platform]
    binaries = [entry for entry in wanted if entry not in sources]
    subprocess.run([*pip, "download", *options, "--dest", folder, *binaries], check=True)
    subprocess.run(
        [*pip, "wheel", "--quiet", "--no-deps", "--wheel-dir", folder, *sources], check=True
    )


def trim(wheel: Path) -> None:
    """Leaves out what is `UNUSED`, in the wheel and in its list, and packs the rest tighter."""
    smaller = wheel.with_suffix(".smaller")
    with (
        zipfile.ZipFile(wheel) as old,
        zipfile.ZipFile(smaller, "w", zipfile.ZIP_LZMA) as new,
    ):
        for entry in old.infolist():
            if UNUSED.match(entry.filename):
                continue
            content = old.read(entry)
            if entry.filename.endswith(".dist-info/RECORD"):
                lines = content.decode().splitlines(keepends=True)
                content = "".join(line for line in lines if not UNUSED.match(line)).encode()
            packed = zipfile.ZipInfo(entry.filename, entry.date_time)
            packed.external_attr, packed.compress_type = entry.external_attr, zipfile.ZIP_LZMA
            new.writestr(packed, content)
    smaller.replace(wheel)


def listed(wheel: Path) -> bool:
    """Whether every file of a wheel is what its list says."""
    with zipfile.ZipFile(wheel) as archive:
        names = {entry.filename for entry in archive.infolist() if not entry.is_dir()}
        (record,) = (name for name in names if name.endswith(".dist-info/RECORD"))
        for line in archive.read(record).decode().splitlines():
            name, checksum, _ = line.rsplit(",", 2)
            names.discard(name)
            if checksum:
                digest = hashlib.sha256(archive.read(name)).digest()
                found = base64.urlsafe_b64encode(digest).rstrip(b"=").decode()
                if f"sha256={found}" != checksum:
                    return False
    return not names


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--python", default="3.12", metavar="VERSION")
    parser.add_argument(
        "--llvm", type=Path, metavar="FILE", help="from 17 on, without links of its own"
    )
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
