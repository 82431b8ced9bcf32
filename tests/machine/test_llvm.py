import subprocess

import pytest

from ngi.machine import llvm


@pytest.fixture
def libraries(tmp_path, monkeypatch):
    """Files that stand for libraries, whose 'child process' answers by their name."""
    answers = {
        "14": (1, "", "AttributeError: libLLVM-14.so: undefined symbol: LLVMGetVersion"),
        "16": (0, "16 0 6\n", ""),
        "17": (0, "17 0 6\n", ""),
        "19": (0, "19 1 7\n", ""),
        "20": (1, "", "Traceback\nOSError: libLLVM-20.so: invalid ELF header"),
    }

    def run(command, **_):
        code, out, err = answers[command[-1].split("-")[-1].split(".")[0]]
        return subprocess.CompletedProcess(command, code, out, err)

    for version in answers:
        (tmp_path / f"libLLVM-{version}.so").touch()
    (tmp_path / "libLLVM-19.so.1").symlink_to(tmp_path / "libLLVM-19.so")
    (tmp_path / "libLLVMCore.a").touch()
    llvm._examine.cache_clear()
    monkeypatch.setattr(llvm, "LIBRARY_PATTERNS", (f"{tmp_path}/libLLVM",))
    monkeypatch.setattr(llvm, "find_library", lambda _: None)
    monkeypatch.setattr(llvm.subprocess, "run", run)
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    yield tmp_path
    llvm._examine.cache_clear()


def test_newest_usable_library_is_found(libraries) -> None:
    found = llvm.find_llvm()
    assert found is not None
    assert found.version == (19, 1, 7)
    assert found.path == str(libraries / "libLLVM-19.so")


def test_one_of_conda_is_found(libraries, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(llvm, "LIBRARY_PATTERNS", ())
    assert llvm.find_llvm() is None
    (tmp_path / "lib").mkdir()
    (libraries / "libLLVM-17.so").rename(tmp_path / "lib" / "libLLVM-17.so")
    monkeypatch.setenv("CONDA_PREFIX", str(tmp_path))
    found = llvm.find_llvm()
    assert found is not None
    assert found.path == f"{tmp_path}/lib/libLLVM-17.so"


@pytest.mark.usefixtures("libraries")
def test_every_candidate_has_a_verdict() -> None:
    verdicts = {c.path.split("-")[-1]: c for c in llvm.llvm_candidates()}
    assert set(verdicts) == {"14.so", "16.so", "17.so", "19.so", "20.so"}
    assert "older than version 16" in verdicts["14.so"].problem
    assert "version 16.0.6" in verdicts["16.so"].problem
    assert "invalid ELF header" in verdicts["20.so"].problem
    assert verdicts["17.so"].problem is None
    assert verdicts["17.so"].version == (17, 0, 6)


def test_environment_wins_where_usable(libraries, monkeypatch) -> None:
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(libraries / "libLLVM-17.so"))
    assert llvm.find_llvm().version == (17, 0, 6)
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(libraries / "libLLVM-16.so"))
    assert llvm.find_llvm().version == (19, 1, 7)


@pytest.mark.usefixtures("libraries")
def test_none(monkeypatch) -> None:
    monkeypatch.setattr(llvm, "LIBRARY_PATTERNS", ())
    assert llvm.find_llvm() is None
