"""The store's patches on disk, as long as a checkpoint needs them."""

from __future__ import annotations

from typing import Any

from ngi.reuse import PatchArchive, PatchStore


class SavedStores:
    """The states of a store that checkpoints hold: of the last two, and of one kept beside them."""

    def __init__(self, store: PatchStore, archive: PatchArchive) -> None:
        self._store = store
        self._archive = archive
        self._last: list[dict[str, Any]] = []
        self._kept: list[dict[str, Any]] = []

    def save(self) -> dict[str, Any]:
        """The store's state; its patches are on disk then."""
        saved = self._archive.save(self._store)
        self._last = [*self._last[-1:], saved]
        return saved

    def restore(self, saved: dict[str, Any]) -> None:
        """Makes the store what it was when this was saved."""
        self._archive.restore(self._store, saved)
        self._last = [saved]

    def keep(self, saved: dict[str, Any] | None = None) -> None:
        """Keeps the patches of a saved state, by default the last, until this is called again."""
        self._kept = [self._last[-1] if saved is None else saved]

    def prune(self) -> None:
        """Deletes patches that neither the last two saved states nor the kept one need.

        Call it once the last one is on disk.
        """
        self._archive.prune([*self._last, *self._kept])
