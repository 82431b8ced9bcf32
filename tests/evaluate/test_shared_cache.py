"""A cache of references that several processes share, and what damage to its files does."""

import logging
import multiprocessing
from multiprocessing import Barrier
from pathlib import Path

import pytest
import torch

from ngi.evaluate import EvaluationProtocol, ReferenceCache
from ngi.render import AnalyticRenderer
from tests import warm

V = torch.tensor([0.25, 0.5, 0.75])
PROCESSES, FRAMES = 2, 20
PROTOCOL = EvaluationProtocol(
    name="test",
    resolution=33,
    low_discrepancy_frames=4,
    target_noise=0.02,
    samples_per_pass=16,
    maximum_samples=64,
)


def noisy() -> AnalyticRenderer:
    return AnalyticRenderer(dimensions=3, patch_size=16, noise=0.1)


def render_all(
    folder: Path, barrier: "Barrier", hashes: "multiprocessing.Queue[list[str]]"
) -> None:
    torch.set_num_threads(1)
    cache, renderer = ReferenceCache(folder), noisy()
    found = []
    for frame in range(FRAMES):
        barrier.wait(timeout=60)  # all render the same frame at the same time
        found.append(cache.get(renderer, PROTOCOL, V + frame / 100).content_hash)
    hashes.put(found)


def test_two_processes_share_a_cache(tmp_path: Path) -> None:
    barrier, hashes = warm.CONTEXT.Barrier(PROCESSES), warm.CONTEXT.Queue()
    arguments = (tmp_path / "shared", barrier, hashes)
    processes = [warm.process(render_all, *arguments) for _ in range(PROCESSES)]
    for process in processes:
        process.start()
    found = [hashes.get(timeout=100) for _ in processes]
    for process in processes:
        process.join()
        assert process.exitcode == 0
    alone = ReferenceCache(tmp_path / "alone")
    expected = [
        alone.get(noisy(), PROTOCOL, V + frame / 100).content_hash for frame in range(FRAMES)
    ]
    assert found == [expected] * PROCESSES
    names = [sorted(f.name for f in (tmp_path / which).iterdir()) for which in ("shared", "alone")]
    assert names[0] == names[1]


def test_whatever_byte_is_flipped_the_reference_is_the_same(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    cache, renderer = ReferenceCache(tmp_path), noisy()
    reference = cache.get(renderer, PROTOCOL, V)
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    # Every 50th byte of the arrays, every 5th of the zip's headers at their ends.
    positions = {
        *range(0, len(whole), 50),
        *range(0, 300, 5),
        *range(len(whole) - 900, len(whole), 5),
    }
    found = 0
    for position in sorted(positions):
        content = bytearray(whole)
        content[position] ^= 0xFF if position % 2 else 1
        file.write_bytes(content)
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            again = cache.get(renderer, PROTOCOL, V)
        assert torch.equal(again.half_a, reference.half_a)
        assert torch.equal(again.half_b, reference.half_b)
        assert (again.key, again.samples_per_pixel, again.noise, again.backend) == (
            reference.key,
            reference.samples_per_pixel,
            reference.noise,
            reference.backend,
        ), position
        if caplog.messages:
            assert f"{file} is damaged" in caplog.text
            found += 1
    assert found > 0.8 * len(positions)


def test_a_cache_that_can_not_be_written_to_says_so(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match=r"not be written.*the folder's permissions.*file/cache"):
        ReferenceCache(tmp_path / "file" / "cache").get(noisy(), PROTOCOL, V)
