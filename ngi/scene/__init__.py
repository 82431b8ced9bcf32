"""Variable scenes: what varies, how far, and where it stands in a loaded Mitsuba scene.

`VariableScene` needs Mitsuba and is imported from `ngi.scene.variable_scene`; everything here
does not.
"""

from ngi.scene.description import SceneDescription
from ngi.scene.folder import read_scene, scenes
from ngi.scene.kinds import KINDS
from ngi.scene.variable import Variable

__all__ = ["KINDS", "SceneDescription", "Variable", "read_scene", "scenes"]
