"""Stored patches are kept on the GPU where they fit, and are the same there."""

import logging
from pathlib import Path

import pytest
import torch

from ngi.config.build import training_device
from ngi.patches import BufferLayout, Patches
from ngi.reuse import CompactPatches, PatchStore
from ngi.reuse.compact import ON_DEVICE
from tests.gpu.pretended import DEVICE, Ledger, on
from tests.gpu.test_runs import RUNS, trained
from tests.learn.comparison import assert_same_run
from tests.learn.composition import run_config
from tests.learn.lightning_warnings import IGNORED, RESUMED

pytestmark = [*IGNORED, RESUMED]

LAYOUT = BufferLayout()
PIXELS = 4 * 4
CAPACITY = 100
BYTES = 4 * 3 + PIXELS * (4 * 3 + 2 * (LAYOUT.channels - 3) + 2 * 3)
"""Of a patch's v, positions, other buffers and radiance."""


def free(monkeypatch: pytest.MonkeyPatch, nbytes: int) -> None:
    monkeypatch.setattr(torch.cuda, "mem_get_info", lambda *_: (nbytes, 2**36))


def patches(count: int) -> Patches:
    blank = Patches.blank(count, layout=LAYOUT, dimensions=3, patch_size=4)
    generator = torch.Generator().manual_seed(0)
    blank.buffers.copy_(torch.rand(blank.buffers.shape, generator=generator))
    blank.log_radiance.copy_(torch.rand(blank.log_radiance.shape, generator=generator))
    return blank


@pytest.mark.usefixtures("gpu")
@pytest.mark.parametrize("fits", [True, False])
def test_half_of_the_free_memory_is_left(
    fits: bool, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    free(monkeypatch, 2 * CAPACITY * BYTES - (not fits))
    caplog.set_level(logging.INFO)
    store = PatchStore(capacity=CAPACITY, layout=LAYOUT, device="cuda")
    ids = store.add(patches(3))
    assert on(store.get(ids).buffers) == fits
    (line,) = (r.getMessage() for r in caplog.records)
    assert f"kept on the {'GPU' if fits else 'CPU'}" in line


def test_what_is_kept_on_the_gpu_is_what_the_cpu_would_keep(gpu: Ledger) -> None:
    there, here = (PatchStore(capacity=8, layout=LAYOUT, device=d) for d in ("cuda", "cpu"))
    for store in (there, here):
        store.add(patches(5))
        store.add(patches(5))  # two of the first make room
    ids = torch.tensor([9, 2, 4])
    gpu.clear()
    kept = there.get(ids)
    assert gpu.waits.total() == gpu.uploads.total() == 0
    expected = here.get(ids)
    for name, tensor in vars(expected).items():
        assert torch.equal(vars(kept)[name].cpu(), tensor)
    assert all(on(getattr(there.get_compact(ids), name)) for name in ON_DEVICE)
    for name in ("position", "resolution", "large_step"):  # which the host decides by
        assert not on(vars(kept)[name])


@pytest.mark.usefixtures("gpu")
def test_patches_of_a_checkpoint_are_taken_where_they_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    first = PatchStore(capacity=8, layout=LAYOUT)
    ids = first.add(patches(5))
    for nbytes in (2**30, 100):
        free(monkeypatch, nbytes)
        second = PatchStore(capacity=8, layout=LAYOUT, device="cuda")
        second.restore(first.state_dict(), [(ids, first.get_compact(ids))])
        assert on(second.get(ids).buffers) == (nbytes > 100)
        assert torch.equal(second.get(ids).buffers.cpu(), first.get(ids).buffers)


@pytest.mark.usefixtures("gpu")
def test_patches_rendered_on_the_gpu_are_refused_where_they_are_not_finite() -> None:
    broken = patches(4)
    broken.log_radiance[2, 0, 0, 0] = torch.inf
    on_gpu = broken.to(DEVICE)
    with pytest.raises(ValueError, match=r"patches \[2\]: log_radiance"):
        CompactPatches.compress(on_gpu, LAYOUT, device=DEVICE)


@pytest.mark.usefixtures("gpu")
def test_a_run_on_the_processor_keeps_them_there() -> None:
    assert training_device(run_config("trainer=fp32")) == "cuda"
    assert training_device(run_config("trainer=fp32", "trainer.accelerator=cpu")) == "cpu"


@pytest.mark.usefixtures("gpu")
@pytest.mark.parametrize("name", ["ours", "cnsr"])
def test_a_run_is_the_same_bit_for_bit_wherever_they_are_kept(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    for folder, nbytes in (("gpu", 2**36), ("cpu", 100)):
        free(monkeypatch, nbytes)
        caplog.clear()
        trained(tmp_path / folder, *RUNS[name])
        assert f"kept on the {folder.upper()}" in caplog.text
    assert_same_run(tmp_path / "gpu" / "run", tmp_path / "cpu" / "run")
