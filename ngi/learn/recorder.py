"""Evaluates a run and keeps what was found: metrics.csv, pictures, result.json."""

from typing import Any

from ngi.evaluate import Evaluation, Evaluator
from ngi.explore import Target
from ngi.learn.run import Run
from ngi.learn.target_map import TargetMap
from ngi.machine.memory import usage
from ngi.machine.provenance import provenance


class Recorder:
    """Writes a row of metrics.csv per evaluation, and at the end the pictures and the result.

    target_map: measured and kept at every evaluation too, or None
    """

    def __init__(
        self, run: Run, *, evaluator: Evaluator, target_map: TargetMap | None, label: dict[str, Any]
    ) -> None:
        self._run = run
        self._evaluator = evaluator
        self._target_map = target_map
        self._predict = run.interruption.checked(run.module.predict)
        self._label = label

    @property
    def targets(self) -> tuple[Target, ...]:
        """Whose densities are asked of the network."""
        return () if self._target_map is None else (self._target_map.target,)

    def prepare(self) -> None:
        """Lets the tracker begin, and renders the reference images that are not cached yet."""
        self._run.tracker.start(
            folder=self._run.folder.path, settings=self._run.folder.settings, label=self._label
        )
        self._evaluator.prepare()
        if self._target_map is not None:
            self._target_map.prepare()

    def evaluate(self) -> Evaluation:
        """Evaluates the network as it is, and appends a row to metrics.csv."""
        with self._run.clock.phase("evaluate"):
            # Killed after this row and before the next checkpoint or the result, a resumed run
            # evaluates again.
            for log in (self._run.folder.metrics, self._run.folder.target_maps):
                log.keep_until(self._run.stream.counters.iteration - 1)
            evaluation = self._evaluator.evaluate(self._predict)
            densities = None if self._target_map is None else self._target_map.measure()
            measured = {**usage(self._run.folder.path), **evaluation.row()}
        row = {**self._progress(), **measured}
        with self._run.clock.phase("evaluate"):
            self._run.folder.metrics.append(row)
            self._run.folder.metrics.flush()
            if densities is not None:
                self._run.folder.target_maps.append(
                    {"step": row["step"], "run_seconds": row["run_seconds"], **densities}
                )
                self._run.folder.target_maps.flush()
            self._run.tracker.evaluated(row, evaluation)
        return evaluation

    def _progress(self) -> dict[str, Any]:
        run_clock, clock, stream = self._run.run_clock, self._run.clock, self._run.stream
        return {
            "step": stream.counters.iteration,
            "run_seconds": run_clock.run_seconds,
            "wall_seconds": clock.run_seconds,
            **{f"{name}_seconds": value for name, value in run_clock.seconds.items()},
            "patches_traced": stream.counters.patches_traced,
            "paths_traced": stream.counters.paths_traced,
            "new_worst_share": stream.new_losses.worst_share,
        }

    def finish(self) -> dict[str, Any]:
        """The last evaluation, with pictures; writes and returns the result."""
        evaluation = self.evaluate()
        folder = self._run.folder
        linear = evaluation.write(folder.path, linear_megabytes=folder.linear_megabytes)
        counters = self._run.stream.counters
        result = {
            **provenance(backend=self._run.renderer.description),
            "identity": self._run.folder.identity,
            "finished": True,
            "label": self._label,
            "seed": self._label["seed"],
            "config": self._run.folder.settings,
            "clock": self._run.run_clock.name,
            "seconds": dict(self._run.run_clock.seconds),
            "run_seconds": self._run.run_clock.run_seconds,
            "wall_seconds": self._run.clock.run_seconds,
            "wall_seconds_by_phase": dict(self._run.clock.seconds),
            "energy_joules": self._run.clock.energy.joules,
            "energy_sources": self._run.clock.energy.sources,
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
            "non_finite_losses": self._run.stream.store.non_finite_losses,
            "new_worst_share": self._run.stream.new_losses.worst_share,
            "scene_hash": self._run.folder.settings["scene"]["hash"],
            **evaluation.result(),
            "linear": linear,
        }
        return self._run.folder.write_result(result)
