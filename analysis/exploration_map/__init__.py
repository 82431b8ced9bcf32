"""Draws the map of when exploration pays: `python -m analysis.exploration_map FOLDER`."""
