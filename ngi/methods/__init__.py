"""Competitors, each whole in one folder: its network, what its samples are, its loss."""
