import logging
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
