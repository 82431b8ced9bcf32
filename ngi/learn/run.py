"""The objects that take part in one run."""

from dataclasses import dataclass

from ngi.clock.budget import Budget
from ngi.clock.phase_clock import PhaseClock, RunClock
from ngi.files.run_folder import RunFolder
from ngi.learn.interruption import Interruption
from ngi.learn.module import IlluminationModule
from ngi.learn.samples import Samples
from ngi.learn.schedule import Schedule
from ngi.learn.stream import TrainingStream
from ngi.learn.tracker import Tracker
from ngi.render.protocol import Renderer


@dataclass(frozen=True, kw_only=True)
class Run:
    """What is made once for a run, and what happens around its steps needs; see the classes.

    run_clock: the clock by which the budget ends; `clock`, or one that counts with measured costs
    """

    folder: RunFolder
    tracker: Tracker
    interruption: Interruption
    budget: Budget
    schedule: Schedule
    renderer: Renderer
    samples: Samples
    stream: TrainingStream
    module: IlluminationModule
    run_clock: RunClock

    @property
    def clock(self) -> PhaseClock:
        """The wall clock, by phase."""
        return self.stream.clock

    @property
    def budget_used(self) -> float:
        """The part of the budget that is used up by now."""
        return self.budget.fraction(
            steps=self.stream.counters.iteration, run_seconds=self.run_clock.run_seconds
        )

    @property
    def schedule_used(self) -> float:
        """What `schedule` goes by: the same, or of steps where the last are on stored patches.

        Of seconds these take up far less than of steps.
        """
        progress = self.stream.progress
        return self.budget_used if progress is None else progress.share()

    @property
    def nears_its_end(self) -> bool:
        """Whether steps depend on how long the run is to be: before, a longer one is the same."""
        progress = self.stream.progress
        alone = progress is not None and progress.too_late
        return alone or self.schedule.decays(self.schedule_used)
