"""From a run's chain records alone, everything that the chains did can be told again."""

from pathlib import Path

import numpy as np
import pandas as pd
import torch

from ngi.explore import ChainInfo, Proposals
from ngi.learn.chain_trace import chain_record
from ngi.patches import Patches
from ngi.reuse import Never
from tests.files.test_record_log import read
from tests.learn.command_line import run
from tests.learn.small_stream import CHAINS, answer, make, steps


def states_of(patches: Patches) -> np.ndarray:
    return torch.cat([patches.scene_vector, patches.position], dim=1).numpy()


def test_records_tell_where_the_chains_stood_and_what_was_compared(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=Never())
    batches = iter(stream)
    state = np.full((CHAINS, 5), np.nan, dtype=np.float32)
    for step in range(30):
        batch = next(batches)
        if step > 0:
            assert batch.current is not None
            np.testing.assert_array_equal(state, states_of(batch.current))
        feedback = answer(batch)
        stream.feedback(feedback)
        record = stream.chain_record
        assert record is not None
        np.testing.assert_array_equal(record["position"], states_of(batch.patches))
        np.testing.assert_array_equal(record["large_step"], batch.patches.large_step)
        np.testing.assert_array_equal(record["initialised"], step == 0)
        if step == 0:
            assert np.isnan([record["target_proposed"], record["target_current"]]).all()
            assert record["accepted"].all()
        else:
            np.testing.assert_array_equal(record["target_proposed"], feedback.losses)
            np.testing.assert_array_equal(record["target_current"], feedback.target_current)
            better = record["target_proposed"] > record["target_current"]
            np.testing.assert_array_equal(record["accepted"], better)
        state = np.where(record["accepted"][:, None], record["position"], state)


def test_only_generated_batches_have_a_record(tmp_path: Path) -> None:
    stream = make(tmp_path)
    generated = []
    for batch in steps(stream, 40):
        if generated:
            assert (stream.chain_record is not None) == generated[-1]
        generated.append(batch.generated)
    assert 0 < sum(generated) < 40


def test_uniform_sampling_has_records_without_targets(tmp_path: Path) -> None:
    stream = make(tmp_path, greedy=False, policy=Never())
    for _ in steps(stream, 3):
        pass
    record = stream.chain_record
    assert record is not None
    assert record["accepted"].all()
    assert np.isnan([record["target_proposed"], record["target_current"]]).all()


def test_positions_are_left_out_where_there_are_very_many_variables() -> None:
    flags = torch.tensor([True, False])
    info = ChainInfo(
        accepted=flags, large_step=flags, initialised=flags, age=torch.zeros(2, dtype=torch.int64)
    )
    for variables, there in ((62, True), (63, False)):
        proposals = Proposals(position=torch.rand(2, variables + 2), large_step=flags)
        record = chain_record(proposals, info, target_proposed=None, target_current=None)
        assert ("position" in record) == there
        assert record["accepted"].tolist() == [True, False]


def test_a_runs_file_agrees_with_its_steps(tmp_path: Path) -> None:
    status, output = run(tmp_path, "run.folder=run", "budget.steps=30")
    assert status == 0, output
    records = read(tmp_path / "run" / "chains.bin")
    table = pd.read_csv(tmp_path / "run" / "steps.csv").set_index("step")
    generated = table.index[table["generated_batches"].diff().fillna(1) > 0]
    assert records["step"].tolist() == generated.tolist()
    later = ~records["initialised"].any(axis=1)
    expected = table.loc[records["step"][later], "acceptance_rate"]
    np.testing.assert_allclose(records["accepted"][later].mean(axis=1), expected)
