"""What this machine has: renderers' backends, memory, energy, precision; where results are made."""
