"""What a run that has ended says of the sampler for the next one; without Mitsuba."""

PAGE = "docs/guide/sampler.md"

CONCENTRATED = 0.2
"""Share of the loss on the worst 5 % of a pilot run's patches from which on a choice pays.

The paper's scenes have 0.08 to 0.12, `shutters`, where light gets in at 5 % of all v, 0.19 to 0.26.
"""


def pilot_advice(worst_share: float) -> str:
    """One line. worst_share: of the loss of a run's new patches, see `ngi.learn.new_losses`."""
    return (
        f"the worst 5% of the new patches had {worst_share:.0%} of the loss "
        f"(if drawn uniformly, exploring pays from {CONCENTRATED:.0%} on: {PAGE})"
    )
