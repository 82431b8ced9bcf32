"""What a run has done so far, which the model clock counts with."""

from dataclasses import dataclass

from ngi.render.protocol import RenderedPatches


@dataclass
class Counters:
    """Running totals of a run; all are logged and checkpointed.

    scored_batches: generated batches for which the chains' current states were scored too
    batches_postponed: how often stored patches were trained on because new ones were not rendered
        yet (`ngi.reuse.Reuse`'s `when_late`)
    batches_refused: rendered batches that held NaN or Inf and were replaced by other proposals'
    steps_refused: steps skipped because the loss or its gradient was not finite (`StepGuard`)
    steps_scaled: steps whose gradient was scaled down, being far larger than the average
    """

    iteration: int = 0
    generated_batches: int = 0
    scored_batches: int = 0
    batches_postponed: int = 0
    patches_traced: int = 0
    paths_traced: int = 0
    patches_repaired: int = 0
    patches_masked: int = 0
    batches_refused: int = 0
    steps_refused: int = 0
    steps_scaled: int = 0

    @property
    def proposed_batches(self) -> int:
        """How often the chains' proposals were rendered, or refused, so far."""
        return self.generated_batches + self.batches_refused

    def count_generated(self, rendered: RenderedPatches) -> None:
        """Adds one generated batch."""
        self.generated_batches += 1
        self.patches_traced += rendered.buffers.shape[:-3].numel()
        self.paths_traced += rendered.paths
        self.patches_repaired += rendered.repaired
        self.patches_masked += rendered.masked
