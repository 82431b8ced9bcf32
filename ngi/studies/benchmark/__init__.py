"""Measures the speed of generation, training, scoring and the store, as ratios inside one run.

`ngi benchmark` prints tables and writes them as JSON. A ratio compares two things that are timed
alternately, so that a slow or busy machine slows both. Every figure is a median with its quartiles
unless its name says otherwise.
"""

PATCHES = 16
"""Patches of a batch (paper, Sec. 4)."""
PATCH_SIZE = 32
"""Pixels along a patch's side."""
