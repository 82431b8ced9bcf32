"""Pieces of work on threads of their own."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from threading import current_thread, main_thread

import pytest
import torch

from ngi.models.parallel import in_parallel


@pytest.fixture(params=[1, 3])
def threads(request: pytest.FixtureRequest) -> Iterator[int]:
    before = torch.get_num_threads()
    torch.set_num_threads(request.param)
    yield request.param
    torch.set_num_threads(before)


def test_results_are_in_the_order_of_the_pieces(threads: int) -> None:
    assert in_parallel(lambda piece: piece**2, range(20)) == [piece**2 for piece in range(20)]
    assert torch.get_num_threads() == threads


def test_a_piece_has_one_thread_and_keeps_no_gradient(threads: int) -> None:
    weight = torch.ones(2, requires_grad=True)

    def look(_: int) -> tuple[int, bool, bool, bool]:
        begun_by = current_thread() is main_thread()
        autocast = torch.is_autocast_enabled("cpu")
        return torch.get_num_threads(), begun_by, (2 * weight).requires_grad, autocast

    with torch.autocast("cpu", torch.bfloat16):
        seen = in_parallel(look, range(8))
    assert set(seen) == {(1, threads == 1, False, False)}


@pytest.mark.parametrize("threads", [7], indirect=True)  # a number that no other test has
def test_threads_that_begin_later_have_everybody_s_number(threads: int) -> None:
    in_parallel(lambda piece: piece, range(8))
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(torch.get_num_threads).result() == threads


@pytest.mark.usefixtures("threads")
def test_what_a_piece_raises_is_raised() -> None:
    with pytest.raises(ZeroDivisionError):
        in_parallel(lambda piece: 1 // piece, [2, 1, 0])
