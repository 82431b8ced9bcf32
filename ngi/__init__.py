"""Neural global illumination of variable scenes by Active Exploration."""

__version__ = "0.1.0"
