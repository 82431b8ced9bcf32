"""Arrays of a pretended Dr.Jit on CUDA, handed over in the order of streams."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from ngi.machine.backend import dr
from ngi.machine.hand_over import overwrite, stacked
from tests.gpu.pretended import Ledger

CUDA, DEVICE = 2, 0
"""DLPack's number of CUDA, and the first card's."""


class CudaArray:
    """Numbers of Dr.Jit that say they are on CUDA. `streams`: those that were told to wait."""

    def __init__(self, numbers: list[float]) -> None:
        self.memory = torch.tensor(numbers)
        self.streams: list[Any] = []

    def __dlpack_device__(self) -> tuple[int, int]:
        return CUDA, DEVICE

    def __dlpack__(self, stream: Any = None) -> Any:  # as Dr.Jit 1.5's, which knows no more of it
        self.streams.append(stream)
        return torch.utils.dlpack.to_dlpack(self.memory)


@pytest.fixture
def in_stream(gpu: Ledger, monkeypatch: pytest.MonkeyPatch) -> Any:  # noqa: ARG001
    """Sets the stream that PyTorch is in; the legacy default stream at first."""

    def enter(handle: int) -> None:
        stream = SimpleNamespace(cuda_stream=handle)
        monkeypatch.setattr(torch.cuda, "current_stream", lambda *_: stream)

    enter(0)

    def forbidden() -> None:
        raise AssertionError("the host waits for Dr.Jit")

    monkeypatch.setattr(dr, "sync_thread", forbidden)
    return enter


@pytest.mark.usefixtures("in_stream")
def test_arrays_become_one_tensor_in_the_legacy_stream_and_the_host_waits_for_nothing(
    gpu: Ledger,
) -> None:
    arrays = [CudaArray([1.0, 2.0, 3.0]), CudaArray([4.0, 5.0, 6.0])]
    assert stacked(arrays).tolist() == [[1, 4], [2, 5], [3, 6]]
    assert [array.streams for array in arrays] == [[None], [None]]  # the legacy one, in DLPack
    assert gpu.waits.total() == 0


@pytest.mark.usefixtures("in_stream")
def test_an_array_is_written_where_it_is(gpu: Ledger) -> None:
    array = CudaArray([1.0, 2.0])
    where = array.memory.data_ptr()
    overwrite(array, np.array([3.0, 4.0]))
    assert (array.memory.tolist(), array.memory.data_ptr()) == ([3, 4], where)
    assert array.streams == [None]
    assert gpu.waits.total() == 0


def test_in_another_stream_nothing_is_handed_over(in_stream: Any) -> None:
    """Dr.Jit would not wait for what is done there, and could write over what is still read."""
    in_stream(94_000)
    array = CudaArray([1.0])
    with pytest.raises(RuntimeError, match=r"outside of torch.cuda.stream"):
        stacked([array])
    with pytest.raises(RuntimeError, match=r"outside of torch.cuda.stream"):
        overwrite(array, np.array([2.0]))
    assert array.memory.tolist() == [1]
