"""Stored patches on disk: each is written once, in segment files beside the checkpoints."""

import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from ngi.files.durable import PARTIAL_SUFFIX, DamagedError, write_tensors
from ngi.reuse.compact import CompactPatches
from ngi.reuse.store import PatchStore

SEGMENT_PATTERN = "patches-*.pt"
SEGMENT_IDS = 2048  # at most, per file: 92 MB of 32 x 32 patches, held in memory twice


class PatchArchive:
    """The immutable part of a store's checkpoints, in one folder of one run.

    folder: where the segment files are; made when the first is written

    The order that never loses a patch, wherever a run is killed:

    1. `state = archive.save(store)` writes the patches added since the last save, as new segments
    2. the caller writes `state` into its checkpoint, and that safely to disk
    3. `archive.prune([state, …])`, with the states of all checkpoints that are still there, removes
       the segments none of them needs

    A segment's name says which ids it may hold, from the first up to but not including the last.
    A run that was killed between 1 and 2 and starts again from its checkpoint writes that segment
    again, with the same content. Half-precision values are saved as they are, so that a restored
    store is the same bit for bit.
    """

    def __init__(self, folder: Path | str) -> None:
        self._folder = Path(folder)
        self._segments: list[dict[str, Any]] = []
        self._saved_until = 0

    def save(self, store: PatchStore) -> dict[str, Any]:
        """Writes what is new and returns the store's state, plain data for a checkpoint.

        Raises OSError (disk full, say) with the file's name; earlier files are intact then, and no
        part of the new one is left.
        """
        ids = store.ids
        for first in range(self._saved_until, store.next_id, SEGMENT_IDS):
            last = min(first + SEGMENT_IDS, store.next_id)
            new = ids[(ids >= first) & (ids < last)]
            if len(new):
                self._segments.append(self._write_segment(store, new, first, last))
            self._saved_until = last
        self._segments = [
            segment
            for segment in self._segments
            if ((ids >= segment["first"]) & (ids < segment["last"])).any()
        ]
        return {**store.state_dict(), "segments": [dict(segment) for segment in self._segments]}

    def restore(self, store: PatchStore, state: dict[str, Any]) -> None:
        """Fills the store with what `save` returned as `state`, and goes on saving from there.

        Raises DamagedError for a missing or damaged segment, and ValueError for a state of another
        scene and for a store that is too small; the store is left as it was.
        """
        store.restore(state, self._read(state))
        self._segments = [dict(segment) for segment in state["segments"]]
        self._saved_until = state["next_id"]

    def check(self, state: dict[str, Any]) -> None:
        """Raises DamagedError where a segment that `state` needs is missing or damaged."""
        for segment in state["segments"]:
            _read_segment(self._folder / segment["name"], segment["checksum"])

    def prune(self, states: Iterable[dict[str, Any]]) -> list[str]:
        """Removes the files that none of these states needs and returns their names.

        `states` are those of all checkpoints that are to stay usable, and they must be on disk.
        """
        needed = {segment["name"] for state in states for segment in state["segments"]}
        removed = []
        for pattern in (SEGMENT_PATTERN, SEGMENT_PATTERN + PARTIAL_SUFFIX):
            for path in sorted(self._folder.glob(pattern)):
                if path.name not in needed:
                    path.unlink()
                    removed.append(path.name)
        return removed

    def _write_segment(
        self, store: PatchStore, ids: Tensor, first: int, last: int
    ) -> dict[str, Any]:
        """Writes the patches of these ids, of first … last - 1, and describes the file."""
        name = f"patches-{first:012d}-{last:012d}.pt"
        compact = store.get_compact(ids).to("cpu")
        write_tensors(self._folder / name, {"ids": ids, **compact.tensors()})
        return {"name": name, "first": first, "last": last, "checksum": _checksum(ids, compact)}

    def _read(self, state: dict[str, Any]) -> Iterator[tuple[Tensor, CompactPatches]]:
        """The patches that `state` holds, segment by segment."""
        for segment in state["segments"]:
            ids, compact = _read_segment(self._folder / segment["name"], segment["checksum"])
            wanted = torch.isin(ids, state["ids"])
            yield (
                ids[wanted],
                CompactPatches(**{n: t[wanted] for n, t in compact.tensors().items()}),
            )


def _read_segment(path: Path, checksum: int) -> tuple[Tensor, CompactPatches]:
    if not path.is_file():
        raise DamagedError(f"{path}: the checkpoint needs these patches, but they are gone")
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
        ids = content.pop("ids")
        compact = CompactPatches(**content)
        damaged = _checksum(ids, compact) != checksum
    except Exception as error:  # torch.load raises nearly anything on a damaged file
        raise DamagedError(
            f"{path} is damaged (not a readable file of patches: {type(error).__name__})"
        ) from error
    if damaged:
        raise DamagedError(f"{path} is damaged (not the patches the checkpoint was made with)")
    return ids, compact


def _checksum(ids: Tensor, compact: CompactPatches) -> int:
    """CRC-32 of names, types, shapes and bytes; torch.load would not notice a flipped bit."""
    checksum = 0
    for name, tensor in {"ids": ids, **compact.tensors()}.items():
        header = f"{name} {tensor.dtype} {list(tensor.shape)}".encode()
        checksum = zlib.crc32(tensor.contiguous().numpy().data, zlib.crc32(header, checksum))
    return checksum
