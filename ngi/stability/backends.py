"""The Mitsuba backends that this machine has."""

from __future__ import annotations

import torch

BACKENDS = ("llvm", "scalar", *(("cuda",) if torch.cuda.is_available() else ()))
