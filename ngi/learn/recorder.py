"""Evaluates a run and keeps what was found: metrics.csv, pictures, result.json."""

from __future__ import annotations

from typing import Any

from ngi.durable import full_disk_named
from ngi.evaluate import Evaluation, Evaluator
from ngi.evaluate.evaluator import Predict
from ngi.learn.clock import PhaseClock, RunClock
from ngi.learn.run_folder import RunFolder
from ngi.learn.stream import TrainingStream
from ngi.learn.target_map import TargetMap
from ngi.learn.tracker import Tracker
from ngi.learn.usage import usage
from ngi.provenance import provenance


class Recorder:
    """Writes a row of metrics.csv per evaluation, and at the end the pictures and the result.

    target_map: measured and kept at every evaluation too, or None
    """

    def __init__(
        self,
        *,
        evaluator: Evaluator,
        target_map: TargetMap | None,
        predict: Predict,
        folder: RunFolder,
        stream: TrainingStream,
        clock: PhaseClock,
        run_clock: RunClock,
        tracker: Tracker,
        label: dict[str, Any],
        backend: str,
    ) -> None:
        self._evaluator = evaluator
        self._target_map = target_map
        self._predict = predict
        self._folder = folder
        self._stream = stream
        self._clock = clock
        self._run_clock = run_clock
        self._tracker = tracker
        self._label = label
        self._backend = backend

    def prepare(self) -> None:
        """Lets the tracker begin, and renders the reference images that are not cached yet."""
        self._tracker.start(
            folder=self._folder.path, settings=self._folder.settings, label=self._label
        )
        self._evaluator.prepare()
        if self._target_map is not None:
            self._target_map.prepare()

    def evaluate(self) -> Evaluation:
        """Evaluates the network as it is, and appends a row to metrics.csv."""
        with self._clock.phase("evaluate"):
            # Killed after this row and before the next checkpoint or the result, a resumed run
            # evaluates again.
            for log in (self._folder.metrics, self._folder.target_maps):
                log.keep_until(self._stream.counters.iteration - 1)
            evaluation = self._evaluator.evaluate(self._predict)
            densities = None if self._target_map is None else self._target_map.measure()
        row: dict[str, Any] = {
            "step": self._stream.counters.iteration,
            "run_seconds": self._run_clock.run_seconds,
            "wall_seconds": self._clock.run_seconds,
            **{f"{name}_seconds": value for name, value in self._run_clock.seconds.items()},
            "patches_traced": self._stream.counters.patches_traced,
            "paths_traced": self._stream.counters.paths_traced,
            **usage(self._folder.path),
            **evaluation.row(),
        }
        self._folder.metrics.append(row)
        self._folder.metrics.flush()
        if densities is not None:
            self._folder.target_maps.append(
                {"step": row["step"], "run_seconds": row["run_seconds"], **densities}
            )
            self._folder.target_maps.flush()
        self._tracker.log(row)
        return evaluation

    def finish(self) -> dict[str, Any]:
        """The last evaluation, with pictures; writes and returns the result."""
        evaluation = self.evaluate()
        with full_disk_named(self._folder.pictures):
            evaluation.write_pictures(self._folder.pictures)
        counters = self._stream.counters
        result = {
            **provenance(backend=self._backend),
            "identity": self._folder.identity,
            "finished": True,
            "label": self._label,
            "seed": self._label["seed"],
            "config": self._folder.settings,
            "clock": self._run_clock.name,
            "seconds": dict(self._run_clock.seconds),
            "run_seconds": self._run_clock.run_seconds,
            "wall_seconds": self._clock.run_seconds,
            "wall_seconds_by_phase": dict(self._clock.seconds),
            "energy_joules": self._clock.energy.joules,
            "energy_sources": self._clock.energy.sources,
            "steps": counters.iteration,
            "generated_batches": counters.generated_batches,
            "scored_batches": counters.scored_batches,
            "patches_traced": counters.patches_traced,
            "paths_traced": counters.paths_traced,
            "patches_repaired": counters.patches_repaired,
            "patches_masked": counters.patches_masked,
            "batches_refused": counters.batches_refused,
            "steps_refused": counters.steps_refused,
            "steps_scaled": counters.steps_scaled,
            "non_finite_losses": self._stream.store.non_finite_losses,
            "scene_hash": self._folder.settings["scene"]["hash"],
            **evaluation.result(),
        }
        return self._folder.write_result(result)
