"""CNSR (Granskog et al. 2020): a scene's code is read off a few rendered observations."""

from ngi.methods.cnsr.network import CNSR
from ngi.methods.cnsr.observation_sets import ObservationSets

__all__ = ["CNSR", "ObservationSets"]
