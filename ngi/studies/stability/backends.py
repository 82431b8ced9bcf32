"""The Mitsuba backends that this machine has."""

from __future__ import annotations

from ngi.machine.backend import cuda_problem

BACKENDS = ("llvm", "scalar", *(("cuda",) if cuda_problem() is None else ()))
