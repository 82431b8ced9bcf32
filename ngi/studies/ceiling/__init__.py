"""How much could any choice of patches gain? Uniform choice against one that knows the truth."""
