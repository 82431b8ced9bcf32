import logging
from ctypes import CDLL
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from ngi.machine import backend


def test_unusable_backends_say_why_and_what_to_do(monkeypatch) -> None:
    monkeypatch.setattr(backend, "_llvm", None)
    monkeypatch.setattr(backend, "cuda_problem", lambda: "no GPU")
    with pytest.raises(
        RuntimeError, match=r"'llvm' does not work here: no usable .*apt-get install"
    ):
        backend.activate("llvm")
    with pytest.raises(RuntimeError, match="'cuda' does not work here: no GPU"):
        backend.activate("cuda")


def test_auto_falls_back_to_scalar_with_one_line(monkeypatch, caplog) -> None:
    monkeypatch.setattr(backend, "_llvm", None)
    monkeypatch.setattr(backend, "cuda_problem", lambda: "no GPU")
    backend._say_what_would_be_faster.cache_clear()
    with caplog.at_level(logging.WARNING):
        assert backend.activate("auto") == backend.activate("auto") == "scalar_rgb"
    assert [r.message.count("apt-get install libllvm19") for r in caplog.records] == [1]
    backend._say_what_would_be_faster.cache_clear()


def test_unknown_backend() -> None:
    with pytest.raises(ValueError, match="'gpu': choose one of"):
        backend.activate("gpu")


def test_auto_takes_llvm_before_scalar(monkeypatch) -> None:
    monkeypatch.setattr(backend, "cuda_problem", lambda: "no GPU")
    if (problem := backend.llvm_problem()) is not None:
        pytest.skip(problem)
    assert backend.activate("auto") == "llvm_ad_rgb"
    assert "LLVM" in backend.describe("llvm_ad_rgb")


def test_cuda_is_described_with_its_gpu_where_torch_sees_it(monkeypatch) -> None:
    monkeypatch.setattr(torch.cuda, "get_device_name", lambda: "Some GPU")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert backend.describe("cuda_ad_rgb").endswith("cuda_ad_rgb, Some GPU")
    assert "Some GPU" not in backend.describe("scalar_rgb")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert backend.describe("cuda_ad_rgb").endswith("cuda_ad_rgb")


def test_a_gpu_needs_a_pytorch_that_can_use_it(monkeypatch) -> None:
    traced = SimpleNamespace(returncode=0, stderr="")
    monkeypatch.setattr(backend, "_has_driver", True)
    monkeypatch.setattr(backend.subprocess, "run", lambda *_, **__: traced)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    problem = backend.cuda_problem.__wrapped__()
    assert problem is not None
    assert "cannot use it; install a build for CUDA" in problem
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert backend.cuda_problem.__wrapped__() is None
    monkeypatch.setattr(backend, "_has_driver", False)
    assert "no NVIDIA driver" in (backend.cuda_problem.__wrapped__() or "")


CORE = Path(backend.dr.__file__).with_name("libdrjit-core.so")


needs_library = pytest.mark.skipif(
    not CORE.is_file(), reason="Dr.Jit's library has another name here"
)


@needs_library
def test_kernels_are_shared_in_small_units() -> None:
    """Dr.Jit's own functions to ask for the size and to set it, by their mangled names."""
    core = CDLL(str(CORE))
    assert core["_Z19jit_llvm_block_sizev"]() == backend.WORK_UNIT
    core["_Z23jit_llvm_set_block_sizej"](2**14)
    backend._share_work(CORE)
    assert core["_Z19jit_llvm_block_sizev"]() == backend.WORK_UNIT


@needs_library
def test_another_library_is_left_alone(monkeypatch, tmp_path) -> None:
    core = CDLL(str(CORE))
    core["_Z23jit_llvm_set_block_sizej"](2**14)
    backend._share_work(tmp_path / "libdrjit-core.so")
    with monkeypatch.context() as patch:
        patch.setattr(backend, "_SET_WORK_UNIT", "not_there")
        backend._share_work(CORE)
    assert core["_Z19jit_llvm_block_sizev"]() == 2**14
    backend._share_work(CORE)
