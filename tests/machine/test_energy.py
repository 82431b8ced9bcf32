from pathlib import Path

import pytest

from ngi.machine.energy import EnergyCounter, EnergyMeter, processor_counters


def zone(folder: Path, number: str, name: str, microjoules: int, *, wraps_at: int = 1000) -> Path:
    path = folder / f"intel-rapl:{number}"
    path.mkdir(parents=True)
    (path / "name").write_text(f"{name}\n")
    (path / "energy_uj").write_text(f"{microjoules}\n")
    (path / "max_energy_range_uj").write_text(f"{wraps_at}\n")
    return path / "energy_uj"


def test_packages_and_memory_count_once(tmp_path: Path) -> None:
    files = {
        name: zone(tmp_path, number, name, 100)
        for number, name in {
            "0": "package-0",
            "0:0": "core",
            "0:1": "dram",
            "1": "package-1",
            "2": "psys",
        }.items()
    }
    meter = EnergyMeter(processor_counters(tmp_path))
    meter.start()
    for microjoules, file in zip((101, 110, 200, 1000, 500), files.values(), strict=True):
        file.write_text(str(microjoules))
    meter.stop()
    assert meter.joules == pytest.approx((1 + 100 + 900) * 1e-6)
    assert [source.split()[1] for source in meter.sources] == ["package-0", "dram", "package-1"]


def test_a_counter_that_wraps_around_goes_on(tmp_path: Path) -> None:
    file = zone(tmp_path, "0", "package-0", 900, wraps_at=1000)
    meter = EnergyMeter(processor_counters(tmp_path))
    meter.start()
    file.write_text("50")
    assert meter.joules == pytest.approx(150e-6)
    file.write_text("70")
    meter.stop()
    assert meter.joules == pytest.approx(170e-6)


def test_a_counter_that_may_not_be_read_is_left_out(tmp_path: Path) -> None:
    zone(tmp_path, "0", "package-0", 0).unlink()  # only root may read it, mostly
    meter = EnergyMeter(processor_counters(tmp_path))
    meter.start()
    meter.stop()
    assert meter.joules is None
    assert meter.sources == []


def test_parts_of_a_resumed_run_add_up_and_the_unknown_stays_unknown() -> None:
    now = [5.0]
    meter = EnergyMeter([EnergyCounter("processor", lambda: now[0])])
    meter.load(7.0)
    meter.start()
    now[0] += 2
    assert meter.joules == 9
    meter.load(None)
    meter.start()
    now[0] += 2
    assert meter.joules is None
    nothing = EnergyMeter([])
    nothing.load(7.0)
    assert nothing.joules is None


def test_a_counter_that_is_gone_makes_energy_unknown_and_ends_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = zone(tmp_path, "0", "package-0", 100)
    meter = EnergyMeter(processor_counters(tmp_path))
    meter.start()
    file.unlink()  # as where a driver is changed meanwhile
    meter.stop()
    assert meter.joules is None
    assert str(file) in caplog.text
    caplog.clear()
    meter.start()
    meter.stop()
    assert meter.joules is None
    assert not caplog.text
