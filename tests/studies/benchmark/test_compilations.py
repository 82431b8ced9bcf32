from pathlib import Path

import pytest

from ngi.machine.backend import activate, dr, llvm_problem, mi
from ngi.studies.benchmark import compilations
from ngi.studies.benchmark.measure import KernelCounts, counted_kernels
from ngi.studies.benchmark.remote import remote
from ngi.studies.benchmark.scenes import shipped

pytestmark = pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))


def compile_something(variant: str) -> None:
    assert variant == "llvm_ad_rgb"
    dr.eval(dr.sin(dr.arange(mi.Float, 7) + 0.123))


def test_dr_jit_keeps_kernels_where_it_is_told_to(tmp_path: Path) -> None:
    (tmp_path / "DRJIT_CACHE_DIR").mkdir()
    environment = compilations.empty_caches(tmp_path)
    with remote(activate, environment=environment) as process:
        process(compile_something)
    assert list((tmp_path / "DRJIT_CACHE_DIR").iterdir())


def test_a_kernel_that_comes_from_the_disk_counts_as_compiled() -> None:
    activate("llvm")
    counts = []
    for _ in range(2):
        dr.flush_kernel_cache()  # of the process's memory; by the second round it is on the disk
        with counted_kernels() as kernels:
            compile_something("llvm_ad_rgb")
        counts.append(kernels.compiled)
    assert counts == [1, 1]
    with counted_kernels() as kernels:
        compile_something("llvm_ad_rgb")
    assert kernels.compiled == 0


def test_patches_come_in_whole_batches() -> None:
    total = compilations.kernels_of_batches(lambda _: KernelCounts(1, 2), "", patches=17)
    assert total == KernelCounts(compiled=2, recorded=4)


@pytest.mark.usefixtures("here")
def test_nothing_is_compiled_after_the_warm_up() -> None:
    [scene] = shipped(["cornell-box"])
    figures = compilations.compilations(scene, samples_per_pixel=1, patches=17)
    measured = {f.name: f.median for f in figures}
    assert measured["kernels compiled in 32 patches after it"] == 0
    assert measured["recordings in 32 patches after it"] == 0
    assert measured["kernels compiled by the warm-up"] >= 0
