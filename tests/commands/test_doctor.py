from importlib.metadata import PackageNotFoundError

import pytest

from ngi.commands import doctor
from ngi.commands.doctor import Finding
from ngi.files.extras import install_command


def test_every_missing_thing_comes_with_what_brings_it() -> None:
    findings = [check() for check in doctor.CHECKS]
    for finding in findings:
        assert finding.detail
        assert finding.present or finding.remedy, finding
    text = doctor.report(findings)
    assert "torch 2." in text
    assert "libLLVM" in text


def test_a_missing_requirement_is_an_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = Finding("renderer", False, "gone", "make setup", required=True)
    optional = Finding("GPU", False, "none", "buy one")
    monkeypatch.setattr(doctor, "CHECKS", (lambda: missing, lambda: optional))
    assert doctor.main([]) == 1
    printed = capsys.readouterr().out
    assert "MISSING renderer: gone" in printed
    assert "to get it: make setup" in printed
    monkeypatch.setattr(doctor, "CHECKS", (lambda: optional,))
    assert doctor.main([]) == 0


def test_a_check_that_can_not_be_made_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_torch() -> Finding:
        raise ModuleNotFoundError("No module named 'torch'")

    def broken_card() -> Finding:
        raise RuntimeError("CUDA error: all CUDA-capable devices are busy or unavailable")

    monkeypatch.setattr(doctor, "REQUIRED", (no_torch,))
    finding = doctor.examine(no_torch)
    assert (finding.present, finding.required, finding.remedy) == (False, True, "make setup")
    assert "torch" in finding.detail
    finding = doctor.examine(broken_card)
    assert (finding.present, finding.required) == (False, False)
    assert "busy" in finding.detail


def test_weights_that_are_named_and_not_there_are_nothing_that_set_up_mends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("NGI_LPIPS_WEIGHTS", "/nowhere.pth")
    finding = doctor.examine(doctor.lpips_weights)
    assert "/nowhere.pth" in finding.detail
    assert finding.remedy == "correct or unset NGI_LPIPS_WEIGHTS"
    assert not finding.required


def test_an_extra_that_is_missing_says_what_is_not_to_be_had(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def no_viewer(name: str) -> str:
        if name == "viser":
            raise PackageNotFoundError
        return "1.0"

    monkeypatch.setattr(doctor, "version", no_viewer)
    finding = doctor.extras()
    assert (finding.present, finding.required) == (False, False)
    assert finding.detail.startswith("denoise, video, export; without viewer: no ngi view")
    assert finding.remedy == install_command("viewer")
    monkeypatch.setattr(doctor, "version", lambda _: "1.0")
    assert doctor.extras().present
