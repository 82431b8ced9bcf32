from pathlib import Path

import numpy as np
import pytest

from analysis.chain_trace import ChainTrace, read_chain_trace
from analysis.runs import Run
from tests.analysis.traces import write_trace

ACCEPTED = np.array([[1, 1], [0, 1], [1, 0], [0, 0], [1, 0]], dtype=bool)
LARGE = np.array([[1, 1], [1, 0], [0, 0], [0, 1], [1, 1]], dtype=bool)
PROPOSED = np.arange(10, dtype=np.float32).reshape(5, 2)


def trace_of(folder: Path) -> ChainTrace:
    trace = read_chain_trace(Run(folder, {}, None))  # type: ignore[arg-type]
    assert trace is not None
    return trace


@pytest.fixture
def trace(tmp_path: Path) -> ChainTrace:
    """Two chains: one leaves its states after 2 and 2 proposals, the other after 1."""
    position = np.arange(5)[:, None, None] / 10 + np.array([[[0.0], [0.01]]]) + np.zeros(3)
    write_trace(
        tmp_path,
        position,
        ACCEPTED,
        large_step=LARGE,
        target_proposed=PROPOSED,
        target_current=PROPOSED + 100,
    )
    return trace_of(tmp_path)


def test_chains_stand_where_they_last_accepted(trace: ChainTrace) -> None:
    assert trace.state is not None
    np.testing.assert_allclose(trace.state[:, 0, 0], [0, 0, 0.2, 0.2, 0.4], atol=1e-6)
    np.testing.assert_allclose(trace.state[:, 1, 2], [0.01, 0.11, 0.11, 0.11, 0.11], atol=1e-6)
    np.testing.assert_array_equal(trace.state_target[:, 1], [1, 3, 105, 107, 109])


def test_rates_leave_out_first_states(trace: ChainTrace) -> None:
    assert trace.acceptance_rate() == 3 / 8
    assert trace.acceptance_rate(large_step=True) == 1 / 4
    assert trace.acceptance_rate(large_step=False) == 2 / 4


def test_lifetimes_count_states_still_held_as_censored(trace: ChainTrace) -> None:
    # Left after 1, 2 and 2 proposals; 3 made from the last state of the second chain, 0 from that
    # of the first. Kaplan and Meier: (1 - 1/4), then (1 - 2/3).
    lifetimes, alive = trace.survival()
    np.testing.assert_allclose(lifetimes, [1, 2, 3])
    np.testing.assert_allclose(alive, [3 / 4, 1 / 4, 1 / 4])
    assert trace.median_lifetime() == 2


def test_a_chain_that_could_not_accept_holds_no_state(tmp_path: Path) -> None:
    accepted = np.array([[0, 1], [1, 0], [0, 1]], dtype=bool)
    write_trace(tmp_path, np.full((3, 2, 3), 0.5), accepted)
    state = trace_of(tmp_path).state
    assert state is not None
    assert np.isnan(state[:, :, 0]).tolist() == [[True, False], [False, False], [False, False]]


def test_states_that_are_never_left_have_no_median(tmp_path: Path) -> None:
    accepted = np.zeros((9, 2), dtype=bool)
    accepted[0] = True
    write_trace(tmp_path, np.zeros((9, 2, 3)), accepted)
    trace = trace_of(tmp_path)
    assert np.isnan(trace.median_lifetime())
    assert np.isnan(trace.acceptance_rate(large_step=False))


def test_what_can_not_be_read_is_left_out_or_named(tmp_path: Path) -> None:
    run = Run(tmp_path, {}, None)  # type: ignore[arg-type]
    assert read_chain_trace(run) is None
    write_trace(tmp_path, np.zeros((3, 2, 4)), np.ones((3, 2), dtype=bool))
    path = tmp_path / "chains.bin"
    whole = path.read_bytes()
    path.write_bytes(whole[:-5])
    assert trace_of(tmp_path).step.tolist() == [1, 2]
    path.write_bytes(b"{}\n" + whole)
    with pytest.raises(ValueError, match=r"chains\.bin is damaged.*fields"):
        read_chain_trace(run)
