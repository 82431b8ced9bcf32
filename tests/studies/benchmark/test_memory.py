from pathlib import Path

import numpy as np
import pytest

from ngi.machine.backend import llvm_problem
from ngi.studies.benchmark import PATCHES, memory
from ngi.studies.benchmark.scenes import shipped

MIB = 2**20


def test_growth_is_that_after_the_first_tenth() -> None:
    batches = np.arange(1, 1001)
    filling = 100 * MIB * np.minimum(batches / 50, 1)  # caches, in the first twentieth
    used = 300 * MIB + filling + 160 * PATCHES * batches
    growth, error, share, peak = memory.growth_figures(used.tolist(), peak=500 * MIB)
    assert growth.median == pytest.approx(160)
    assert error.median == pytest.approx(0, abs=1e-6)
    assert share.median == pytest.approx(100 * 160 * 10_000 / (500 * MIB))
    assert peak.median == 500


@pytest.mark.usefixtures("here")
def test_too_few_patches_to_tell_a_growth_are_refused() -> None:
    [scene] = shipped(["cornell-box"])
    with pytest.raises(ValueError, match=f"at least {4 * PATCHES}"):
        memory.memory(scene, samples_per_pixel=1, patches=3 * PATCHES)


@pytest.mark.usefixtures("here")
@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
def test_memory_of_a_process_is_what_linux_counts() -> None:
    [scene] = shipped(["cornell-box"])
    patches = 4 * PATCHES
    growth, _, _, peak = memory.memory(scene, samples_per_pixel=1, patches=patches)
    status = Path("/proc/self/status").read_text().splitlines()
    [kibibytes] = [int(line.split()[1]) for line in status if line.startswith("VmHWM")]
    assert peak.median == pytest.approx(kibibytes / 1024, rel=0.05)
    assert abs(growth.median) * patches < peak.median * MIB
