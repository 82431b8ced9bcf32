"""Run time counted with measured costs, so that a busy machine cannot decide a comparison."""

from collections.abc import Callable

from ngi.clock.costs import Costs
from ngi.clock.counters import Counters
from ngi.clock.phase_clock import PAUSES, PHASES

STEPS_OF: dict[str, Callable[[Counters], int]] = {
    "training": lambda counters: counters.iteration,
    "exploring": lambda counters: counters.proposed_batches,
    "rendering": lambda counters: counters.proposed_batches,
    "scoring": lambda counters: counters.scored_batches,
}
"""How many steps had each component of `ngi.clock.costs`."""


class ModelClock:
    """Run time counted with measured costs: steps of each kind times their seconds.

    The same steps take the same time, bit for bit, however fast this machine is and whatever else
    it does; also with renderer processes beside training, whose patches count as if training had
    rendered them itself. Evaluations and checkpoints take no time.

    costs: seconds per step by component and phase
    counters: gives the run's counters as they are now; a checkpoint holds them
    """

    name = "model"

    def __init__(self, *, costs: Costs, counters: Callable[[], Counters]) -> None:
        self._costs = costs
        self._counters = counters

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds so far of every phase; 0 for the pauses."""
        counters = self._counters()
        total = dict.fromkeys((*PHASES, *PAUSES), 0.0)
        for component, by_phase in self._costs.items():
            steps = STEPS_OF[component](counters)
            for phase, seconds in by_phase.items():
                total[phase] += steps * seconds
        return total

    @property
    def run_seconds(self) -> float:
        """Seconds of run time."""
        return sum(self.seconds.values())
