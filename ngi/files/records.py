"""What the records of a run's binary logs hold."""

MOST_VARIABLES = 62
"""Positions are left out in scenes of more variables: their files would grow to gigabytes."""

CHAINS = (
    "One record per generated batch of n chains; step as in steps.csv. "
    "position [n, S]: the proposals, scene variables and then patch position, in [0, 1] "
    f"(left out in scenes of more than {MOST_VARIABLES} variables). "
    "large_step, accepted [n]: a chain that accepted stands at its proposal, any other where it "
    "stood. initialised [n]: the chain held no state before. "
    "target_proposed, target_current [n]: target density of the proposal and of the state before, "
    "under the weights of that step; NaN where it was not computed."
)

TARGET_MAPS = (
    "One record per evaluation; step and run_seconds as in metrics.csv. state [g, g, k, 4]: k "
    "patches in each of g x g cells of [0, 1]^2, scene variables and then patch position, the same "
    "in every record; the first index is the cell along the first scene variable. loss, target "
    "[g, g, k]: their training loss and target density."
)
