import json
from dataclasses import replace
from multiprocessing import resource_tracker
from pathlib import Path

import pandas as pd
import pytest

from ngi.studies.exploration_map import campaign
from ngi.studies.exploration_map.__main__ import main
from ngi.studies.exploration_map.plan import BASE, PLANS, Plan
from ngi.studies.exploration_map.setting import METHODS, Method
from tests import warm
from tests.waiting import wait_for

PLAN = Plan(settings=(BASE, replace(BASE, volume=0.1)), steps=4, evaluations=2, frames=20)


class InThisProcess:
    """Stands in for the pool of processes, which take seconds to start."""

    def __init__(self, *_, **__) -> None: ...
    def __enter__(self):
        return self

    def __exit__(self, *_) -> None: ...
    def shutdown(self, **_) -> None: ...

    def submit(self, work, run):
        future = campaign.Future()
        try:
            future.set_result(work(run))
        except RuntimeError as error:
            future.set_exception(error)
        return future


@pytest.fixture
def trained(monkeypatch: pytest.MonkeyPatch) -> list[campaign.Run]:
    """The runs that were done, each of which leaves two made-up rows."""
    done: list[campaign.Run] = []

    def made_up(setting, method, seed, plan, *, folder):  # noqa: ARG001
        done.append(campaign.Run(setting, method, seed))
        if len(done) == 10:
            raise RuntimeError("the tenth run fails")
        for step in (2, 4):
            yield {"volume": setting.volume, "method": method.name, "seed": seed, "step": step}

    monkeypatch.setattr(campaign, "train", made_up)
    monkeypatch.setattr(campaign, "ProcessPoolExecutor", InThisProcess)
    return done


def test_an_interrupted_map_goes_on(tmp_path: Path, trained: list[campaign.Run]) -> None:
    with pytest.raises(RuntimeError, match="tenth"):
        campaign.run_all(PLAN, seeds=[3, 4], folder=tmp_path, jobs=1)
    first = list(trained)
    assert not (tmp_path / "exploration_map.csv").exists()
    table = pd.read_csv(campaign.run_all(PLAN, seeds=[3, 4], folder=tmp_path, jobs=1))
    assert len(table) == 2 * 2 * len(METHODS) * 2
    assert not table.duplicated(["volume", "method", "seed", "step"]).any()
    failed = first[9]
    assert [run for run in trained if trained.count(run) > 1] == [failed, failed]
    done = len(trained)
    campaign.run_all(PLAN, seeds=[3, 4], folder=tmp_path, jobs=1)
    assert len(trained) == done


def test_a_run_that_leads_nowhere_is_named_and_keeps_its_report_beside_it(
    tmp_path: Path, trained: list[campaign.Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    places = []

    def diverging(setting, method, seed, plan, *, folder):  # noqa: ARG001
        places.append(folder)
        raise FloatingPointError("step 9 is the 10th in a row")
        yield

    monkeypatch.setattr(campaign, "train", diverging)
    with pytest.raises(ValueError, match=r"uniform-seed=3\.csv cannot be made: step 9"):
        campaign.run_all(PLAN, seeds=[3], folder=tmp_path, jobs=1)
    assert places == [campaign.Run(BASE, METHODS[0], 3).file(tmp_path).parent]
    assert trained == []


def test_all_settings_come_before_the_second_seed(
    tmp_path: Path, trained: list[campaign.Run]
) -> None:
    trained += [campaign.Run(BASE, Method("none", False), 0)] * 10  # past the one that fails
    campaign.run_all(PLAN, seeds=[3, 4], folder=tmp_path, jobs=1)
    seeds = [run.seed for run in trained[10:]]
    assert seeds == [3] * (len(seeds) // 2) + [4] * (len(seeds) // 2)


def test_runs_of_another_size_are_refused(tmp_path: Path, trained: list[campaign.Run]) -> None:
    trained += [campaign.Run(BASE, Method("none", False), 0)] * 10
    campaign.run_all(PLAN, seeds=[3], folder=tmp_path, jobs=1)
    longer = replace(PLAN, steps=8)
    with pytest.raises(ValueError, match=r"provenance.json: .* a different size"):
        campaign.run_all(longer, seeds=[3], folder=tmp_path, jobs=1)
    file = tmp_path / "provenance.json"
    changed = json.loads(file.read_text())
    changed["configuration"]["uniform"]["loss"]["l1_weight"] = 3.0
    file.write_text(json.dumps(changed))
    with pytest.raises(ValueError, match="a different configuration"):
        campaign.run_all(PLAN, seeds=[3], folder=tmp_path, jobs=1)


def test_provenance_holds_what_a_run_is_built_from(
    tmp_path: Path, trained: list[campaign.Run]
) -> None:
    trained += [campaign.Run(BASE, Method("none", False), 0)] * 10
    campaign.run_all(PLAN, seeds=[3], folder=tmp_path, jobs=1)
    found = json.loads((tmp_path / "provenance.json").read_text())
    assert {"commit", "versions", "machine"} <= found.keys()
    assert found["size"] == {"steps": 4, "evaluations": 2, "frames": 20}
    assert found["configuration"]["loss_greedy-reuse"]["reuse"]["policy"]["beta"] == 2.0


def run_many(folder: Path) -> None:
    """More runs than anybody waits for, in two further processes."""
    warm.begin(folder / "output")
    tracker = resource_tracker._resource_tracker  # an own one frees what the pool leaves behind
    tracker._fd = tracker._pid = None
    few = replace(PLANS["smoke"], methods=METHODS[:2])
    campaign.run_all(few, seeds=range(100), folder=folder, jobs=2)


def test_no_process_is_left_where_the_first_one_is_killed(tmp_path: Path) -> None:
    process = warm.process(run_many, tmp_path)
    process.start()
    wait_for(lambda: any(tmp_path.glob("runs/*/*.csv")), seconds=120)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    assert len(children) >= 2
    process.kill()
    process.join()
    wait_for(lambda: not any(map(runs, children)), seconds=120)


def runs(pid: str) -> bool:
    """Whether there is such a process, and not just its status for a parent to ask for."""
    try:
        return Path("/proc", pid, "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = {}

    def run_all(plan, *, seeds, folder, jobs):
        asked.update(plan=plan, seeds=seeds, folder=folder, jobs=jobs)
        raise ValueError("no such luck")

    monkeypatch.setattr(campaign, "run_all", run_all)
    arguments = ["--settings", "smoke", "--seeds", "7", "8", "--jobs", "3"]
    assert main([*arguments, "--output", str(tmp_path)]) == 1
    assert (asked["seeds"], asked["folder"], asked["jobs"]) == ([7, 8], tmp_path, 3)
    assert asked["plan"].steps == 24
    assert "error: no such luck" in capsys.readouterr().err
