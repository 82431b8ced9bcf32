"""Says what this machine has for rendering and training: `ngi doctor`."""

import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ngi.config.options import run_tool
from ngi.files.extras import EXTRAS, install_command, requirements
from ngi.machine.provenance import LIBRARIES
from ngi.machine.size import usable_cores


@dataclass
class DoctorOptions:
    """Lists what this machine has for rendering and training, and how to get what is missing.

    Exit status 0 when the program can run here, 1 when it can't.
    """


@dataclass(frozen=True)
class Finding:
    """One line of the report.

    required: the program can not run without it
    remedy: the command or step that brings it; empty where it is there
    """

    name: str
    present: bool
    detail: str
    remedy: str = ""
    required: bool = False


def python() -> Finding:
    current = platform.python_version()
    return Finding(
        "Python", sys.version_info >= (3, 11), current, "install Python 3.11 or newer", True
    )


def libraries() -> Finding:
    missing, found = [], []
    for name in LIBRARIES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            missing.append(name)
    detail = ", ".join(found) + (f"; missing: {', '.join(missing)}" if missing else "")
    return Finding("libraries", not missing, detail, "make setup", True)


def torch_device() -> Finding:
    import torch

    threads = f"{torch.get_num_threads()} threads of {usable_cores()} cores"
    if torch.cuda.is_available():
        return Finding("PyTorch on a GPU", True, torch.cuda.get_device_name())
    build = "a CUDA build that sees no GPU" if torch.version.cuda else "a CPU build"
    return Finding(
        "PyTorch on a GPU", False, f"{build}; the CPU is used ({threads})",
        "without an NVIDIA GPU nothing; otherwise install its driver and a CUDA build of PyTorch",
    )  # fmt: skip


def llvm() -> Finding:
    from ngi.machine.llvm import INSTALL_COMMAND, WITHOUT_ROOT, find_llvm, llvm_candidates

    chosen = find_llvm()
    if chosen is not None:
        return Finding("libLLVM (fast CPU renderer)", True, str(chosen))
    rejected = "; ".join(f"{c.path}: {c.problem}" for c in llvm_candidates()) or "none found"
    remedy = f"{INSTALL_COMMAND}, {WITHOUT_ROOT}"
    return Finding("libLLVM (fast CPU renderer)", False, rejected, remedy)


def optix() -> Finding:
    """The NVIDIA driver brings OptiX; without a driver there is no CUDA backend."""
    name = "NVIDIA driver and OptiX (GPU renderer)"
    tool = shutil.which("nvidia-smi")
    if tool is None:
        return Finding(
            name, False, "no NVIDIA driver", "if there is an NVIDIA GPU, install its driver"
        )
    query = [tool, "--query-gpu=name,driver_version", "--format=csv,noheader"]
    answer = subprocess.run(query, capture_output=True, text=True, check=False)
    if answer.returncode != 0:
        return Finding(
            name, False, answer.stdout.strip() or answer.stderr.strip(), "repair the driver"
        )
    places = ("/usr/lib", "/usr/lib64", "/usr/lib/x86_64-linux-gnu", "/usr/local/nvidia/lib64")
    library = next((p for d in places for p in Path(d).glob("libnvoptix.so*")), None)
    detail = answer.stdout.strip()
    if library is None:
        return Finding(
            name, False, f"{detail}, but no libnvoptix.so", "install the driver's OptiX package: "
            "apt-get install libnvoptix1"
        )  # fmt: skip
    return Finding(name, True, f"{detail}, {library}")


def renderer() -> Finding:
    """Which backends work; asked in a child process, since a broken driver can abort it."""
    code = """
from ngi.machine.backend import activate, cuda_problem, llvm_problem
problems = {"cuda": cuda_problem(), "llvm": llvm_problem()}
print(activate("auto"))
for name, problem in problems.items():
    print(f"{name}: {problem or 'works'}")
"""
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    if answer.returncode != 0:
        last = (answer.stderr.strip().splitlines() or ["no message"])[-1]
        return Finding("Mitsuba", False, last, "make setup", True)
    variant, *backends = answer.stdout.strip().splitlines()
    detail = f"renders with {variant} (scalar: works; {'; '.join(backends)})"
    return Finding("Mitsuba", True, detail)


def extras() -> Finding:
    """Optional packages; ours does not train without its denoiser."""
    missing = [extra for extra in EXTRAS if not _installed(extra)]
    there = ", ".join(extra for extra in EXTRAS if extra not in missing) or "none"
    lacking = "; ".join(f"without {extra}: no {EXTRAS[extra]}" for extra in missing)
    detail = f"{there}; {lacking}" if lacking else there
    return Finding("extras", not missing, detail, " && ".join(map(install_command, missing)))


def _installed(extra: str) -> bool:
    try:
        return all(version(re.split("[=<>~!]", each)[0]) for each in requirements(extra))
    except PackageNotFoundError:
        return False


def lpips_weights() -> Finding:
    from ngi.evaluate import Lpips

    configured = os.environ.get("NGI_LPIPS_WEIGHTS")
    try:
        metric = Lpips(weights=configured)
    except (ValueError, OSError) as error:
        remedy = "correct or unset NGI_LPIPS_WEIGHTS" if configured else "delete it, and make setup"
        return Finding("LPIPS weights", False, str(error), remedy)
    detail = "found" if metric.available else "none: the LPIPS column stays empty"
    return Finding("LPIPS weights", metric.available, detail, metric.reason or "")


CHECKS: tuple[Callable[[], Finding], ...] = (
    python, libraries, renderer, llvm, optix, torch_device, lpips_weights, extras,
)  # fmt: skip


REQUIRED = (python, libraries, renderer)
"""Checks without whose result the program cannot run."""


def examine(check: Callable[[], Finding]) -> Finding:
    """The check's finding; a check that can not even be made, whatever is in its way, is one too.

    Its other findings are what somebody needs whose machine is broken.
    """
    try:
        return check()
    except Exception as error:
        required = check in REQUIRED
        remedy = "make setup" if required or isinstance(error, ImportError) else ""
        return Finding(check.__name__.replace("_", " "), False, str(error), remedy, required)


def report(findings: Sequence[Finding]) -> str:
    lines = []
    for finding in findings:
        mark = "ok     " if finding.present else ("MISSING" if finding.required else "absent ")
        lines.append(f"{mark} {finding.name}: {finding.detail}")
        if not finding.present and finding.remedy:
            lines.append(f"          to get it: {finding.remedy}")
    return "\n".join(lines)


def doctor(_: DoctorOptions) -> int:
    """Prints the report; the exit status."""
    findings = [examine(check) for check in CHECKS]
    print(report(findings))
    return int(any(f.required and not f.present for f in findings))


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi doctor`."""
    return run_tool(doctor, DoctorOptions, "ngi doctor", arguments)
