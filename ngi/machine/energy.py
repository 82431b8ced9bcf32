"""Energy that processors and GPU have used, from the counters that hardware keeps of it."""

import ctypes
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

log = logging.getLogger(__name__)

POWERCAP = Path("/sys/class/powercap")
"""Where Linux shows Intel's and AMD's RAPL counters; on most systems for root only."""
COUNTED_ZONES = ("package-", "dram")
"""Names of the zones that count: 'core' and 'uncore' are parts of a package, 'psys' holds it."""


@dataclass(frozen=True)
class EnergyCounter:
    """A counter of joules that only grows, but for starting again at 0 after `wraps_at`."""

    name: str
    read: Callable[[], float]
    wraps_at: float | None = None


class EnergyMeter:
    """Joules between each `start` and `stop`, over all counters; None where there is no counter.

    Where a counter can no longer be read, as after a driver has been changed, that is logged, and
    the energy is unknown from then on: a run goes on without.
    What a counter counts, it counts for the whole processor or GPU, whoever uses it. Between two
    readings a counter may wrap around once; a server's takes a quarter of an hour or more for that.
    """

    def __init__(self, counters: Sequence[EnergyCounter]) -> None:
        self._counters = list(counters)
        self._since: list[float] | None = None
        self._joules: float | None = 0.0 if counters else None

    @property
    def sources(self) -> list[str]:
        """Names of the counters."""
        return [counter.name for counter in self._counters]

    @property
    def joules(self) -> float | None:
        """So far."""
        if self._since is not None:
            self.start()
        return self._joules

    def start(self) -> None:
        """Begins, or goes on, counting."""
        self.stop()
        self._since = self._read()

    def stop(self) -> None:
        """Counts what has been used since `start`, if it was called."""
        since, self._since = self._since, None
        if since is None or (read := self._read()) is None or self._joules is None:
            return
        for counter, before, now in zip(self._counters, since, read, strict=True):
            wrapped = counter.wraps_at if now < before and counter.wraps_at is not None else 0.0
            self._joules += now - before + wrapped

    def load(self, joules: float | None) -> None:
        """Goes on from an earlier process's `joules`; unknown energy stays unknown."""
        self._joules = None if self._joules is None else joules

    def _read(self) -> list[float] | None:
        try:
            return [counter.read() for counter in self._counters]
        except OSError as error:
            log.warning("energy is no longer recorded: %s", error)
            self._counters, self._joules = [], None
            return None


def energy_counters() -> list[EnergyCounter]:
    """Those of processors and GPU that this process may read."""
    gpu = _gpu_counter()
    return [*processor_counters(), *([] if gpu is None else [gpu])]


def processor_counters(powercap: Path = POWERCAP) -> list[EnergyCounter]:
    """RAPL's, of every processor and of the memory, as far as this process may read them."""
    found = []
    for zone in sorted(powercap.glob("intel-rapl:*")):
        try:
            name = (zone / "name").read_text().strip()
            wraps_at = float((zone / "max_energy_range_uj").read_text()) / 1e6
            float((zone / "energy_uj").read_text())
        except (OSError, ValueError):
            continue
        if name.startswith(COUNTED_ZONES):

            def read(file: Path = zone / "energy_uj") -> float:
                return float(file.read_text()) / 1e6

            found.append(EnergyCounter(f"{zone.name} {name}", read, wraps_at))
    return found


def _gpu_counter() -> EnergyCounter | None:
    """NVML's, of the GPU that PyTorch uses; GPUs before Volta have none."""
    import torch

    if not torch.cuda.is_available():
        return None
    try:
        nvml = ctypes.CDLL("libnvidia-ml.so.1")
    except OSError:
        return None
    device = ctypes.c_void_p()
    uuid = f"GPU-{torch.cuda.get_device_properties(torch.cuda.current_device()).uuid}"
    millijoules = ctypes.c_ulonglong()

    def read() -> float:
        status = nvml.nvmlDeviceGetTotalEnergyConsumption(device, ctypes.byref(millijoules))
        if status != 0:
            raise OSError(f"NVML could not read the energy of {uuid}: status {status}")
        return millijoules.value / 1e3

    if nvml.nvmlInit_v2() or nvml.nvmlDeviceGetHandleByUUID(uuid.encode(), ctypes.byref(device)):
        return None
    try:
        read()
    except OSError:
        return None
    return EnergyCounter(torch.cuda.get_device_name(), read)
