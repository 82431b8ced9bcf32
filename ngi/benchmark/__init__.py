"""Measures the speed of generation, training, scoring and the store, as ratios inside one run.

`python -m ngi.benchmark` prints a table and writes it as JSON. A ratio compares two things timed
in turn within one process, so that a slow or busy machine slows both; every figure is a median
with its quartiles.
"""
