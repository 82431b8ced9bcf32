"""Scenes in the tagged file format of the paper's released program."""

from ngi.scene.release.reader import read_release

__all__ = ["read_release"]
