"""Variable scenes: what varies, how far, and where it stands in a loaded Mitsuba scene.

`VariableScene` needs Mitsuba and is imported from `ngi.scene.variable_scene`; everything here
does not.
"""

from ngi.scene.description import SceneDescription, read_scene
from ngi.scene.properties import PROPERTIES, Property
from ngi.scene.variables import (
    Variable,
    check_scene_vector,
    component_names,
    scene_vector_of,
    variable_values,
)

__all__ = [
    "PROPERTIES",
    "Property",
    "SceneDescription",
    "Variable",
    "check_scene_vector",
    "component_names",
    "read_scene",
    "scene_vector_of",
    "variable_values",
]
