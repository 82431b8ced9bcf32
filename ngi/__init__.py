"""Neural global illumination of variable scenes by Active Exploration."""

import logging
import os

__version__ = "0.2.0"

# PyTorch's waiting threads must not burn the time of Dr.Jit's, which share the cores. OpenMP reads
# this once, when it is loaded, hence here.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
os.environ.setdefault("GOMP_SPINCOUNT", "0")

# Of a missing font cache or an unwritable home it says, at its import, what nobody here needs.
logging.getLogger("matplotlib").setLevel(logging.ERROR)
