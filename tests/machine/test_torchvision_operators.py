import subprocess
import sys
import textwrap

import pytest
import torch

from ngi.machine import torchvision_operators
from ngi.machine.torchvision_operators import ensure_torchvision_operators


def run(program: str) -> str:
    """Runs in a fresh interpreter: what was imported here must not count there."""
    return subprocess.run(
        [sys.executable, "-W", "ignore", "-c", textwrap.dedent(program)],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()


def test_lightning_and_lpips_can_be_imported_afterwards() -> None:
    output = run(
        """
        import sys
        from ngi.machine.torchvision_operators import ensure_torchvision_operators
        ensure_torchvision_operators()
        ensure_torchvision_operators()
        print("torchvision" in sys.modules)
        import lightning, lpips, torchmetrics
        ensure_torchvision_operators()
        """
    )
    assert output == "False"


@pytest.fixture
def fresh(monkeypatch) -> list[str]:
    """Records what would be declared, in a process that has not seen torchvision."""
    defined: list[str] = []

    class Library:
        def __init__(self, *_: str) -> None: ...

        def define(self, signature: str) -> None:
            defined.append(signature.split("(")[0])

    monkeypatch.setattr(torch.library, "Library", Library)
    monkeypatch.setattr(torchvision_operators, "_declared", [])
    monkeypatch.delitem(sys.modules, "torchvision", raising=False)
    return defined


def test_declares_once_where_the_compiled_part_does_not_load(fresh, monkeypatch) -> None:
    def broken(_: str) -> None:
        raise OSError("undefined symbol")

    monkeypatch.setattr(torch.ops, "load_library", broken)
    ensure_torchvision_operators()
    ensure_torchvision_operators()
    assert fresh == ["nms", "qnms"]


def test_declares_nothing_where_torchvision_is_sound(fresh, monkeypatch) -> None:
    loaded: list[str] = []
    monkeypatch.setattr(torch.ops, "load_library", loaded.append)
    ensure_torchvision_operators()
    assert len(loaded) == 1
    assert fresh == []


def test_declares_nothing_where_torchvision_is_absent(fresh, monkeypatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    ensure_torchvision_operators()
    assert fresh == []
