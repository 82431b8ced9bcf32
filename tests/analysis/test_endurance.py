from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.endurance import endurance, main

HOURS = np.linspace(0, 4, 49)


def write(folder: Path, *, growth: float = 0.0, rows: int = 49) -> Path:
    """Of a run that takes 100 MiB and `growth` more per hour, at 5 steps per second."""
    generator = np.random.default_rng(0)
    table = pd.DataFrame(
        {
            "step": (HOURS * 3600 * 5).astype(int),
            "wall_seconds": HOURS * 3600,
            "resident_bytes": (100 + growth * HOURS + generator.normal(0, 0.5, 49)) * 2**20,
            "allocated_bytes": None,
            "open_files": 20,
            "folder_bytes": (HOURS * 2**20).astype(int),
            "cpu_seconds": HOURS * 3600 * 0.5
            - (HOURS > 2.5) * 3000,  # went on after an interruption
        }
    )
    table.head(rows).to_csv(folder / "metrics.csv", index=False)
    return folder


def test_growth_is_told_from_noise(tmp_path: Path) -> None:
    flat, growing = (
        endurance(write(tmp_path, growth=growth)).set_index("quantity").loc["main memory, MiB"]
        for growth in (0.0, 3.0)
    )
    assert abs(flat["change per hour"]) < 2 * flat["± (95 %)"]
    assert growing["change per hour"] == pytest.approx(3, abs=0.2)
    assert growing["± (95 %)"] < 0.2
    assert growing["last quarter"] - growing["first quarter"] == pytest.approx(3 * 2.7, abs=0.8)


def test_speed_files_and_disk(tmp_path: Path) -> None:
    table = endurance(write(tmp_path)).set_index("quantity")
    assert table.loc["steps per second", "first quarter"] == pytest.approx(5, rel=1e-3)
    per_processor_second = table.loc["steps per second of processor time"]
    assert per_processor_second["first quarter"] == pytest.approx(10, rel=1e-3)
    assert per_processor_second["change per hour"] == pytest.approx(0, abs=0.01)
    assert table.loc["folder, MiB", "change per hour"] == pytest.approx(1, rel=1e-3)
    assert "main memory in use, MiB" not in table.index, "not known"
    assert table.loc["open files", ["first quarter", "change per hour"]].tolist() == [20, 0]


def test_a_short_or_missing_run_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, rows=5)
    assert main([str(tmp_path)]) == 1
    assert "5 evaluations are too few" in capsys.readouterr().err
    assert main([str(tmp_path / "nothing")]) == 1
    assert "nothing" in capsys.readouterr().err
    assert main([str(write(tmp_path))]) == 0
    assert "main memory" in capsys.readouterr().out
