"""All that decides about the reuse of patches in one run."""

from dataclasses import dataclass

from ngi.reuse.archive import PatchArchive
from ngi.reuse.policies import ReusePolicy
from ngi.reuse.store import PatchStore

WHEN_LATE = ("wait", "reuse")


@dataclass(frozen=True)
class Reuse:
    """The store, where it is saved, and when a batch is drawn from it.

    when_late: what to do where a new batch is due that is not rendered yet: 'wait' for it, or
        'reuse' stored patches until it is, which makes the batches depend on the machine's speed.
        Where the policy would never reuse, as in the bootstrap, it is waited for all the same.
        ValueError for any other word.
    """

    store: PatchStore
    archive: PatchArchive
    policy: ReusePolicy
    when_late: str

    def __post_init__(self) -> None:
        if self.when_late not in WHEN_LATE:
            raise ValueError(
                f"reuse.when_late: '{self.when_late}'; expected one of {list(WHEN_LATE)}: wait for "
                "patches that are not rendered yet, or train on stored ones until they are"
            )

    def check_capacity(self, *, chains: int) -> None:
        """Raises ValueError where the store is smaller than two batches of so many patches."""
        if self.store.capacity < 2 * chains:
            raise ValueError(
                f"reuse.store.capacity: {self.store.capacity} patches do not hold the chains' "
                f"current states and a new batch; expected at least {2 * chains}"
            )
