"""ANF (Işık et al. 2021): a denoiser of the frames of an animation, trained on this scene."""

from ngi.methods.anf.loss import SequenceSmape
from ngi.methods.anf.network import AffinityDenoiser
from ngi.methods.anf.sequences import Sequences

__all__ = ["AffinityDenoiser", "SequenceSmape", "Sequences"]
