"""Which sampler a variable scene asks for, as far as can be told before anything is rendered."""

from ngi.render.materials import Material
from ngi.render.pilot_advice import CONCENTRATED, PAGE
from ngi.scene.kinds import (
    Direction,
    Intensity,
    KeyFrames,
    Rotation,
    Roughness,
    Translation,
)
from ngi.scene.scene_parameters import emits
from ngi.scene.variable import Variable
from ngi.scene.variable_scene import VariableScene

SHINY = 0.1
"""Roughness (alpha) up to which a surface gathers light into caustics."""

WORTH_A_SETUP = 200
"""Samples per pixel from which on a scene is set up in next to no time beside a patch's paths."""

DEAR = 1000
"""Samples per pixel from which on the number of patches decides more than any choice of them."""

MOVES = (Translation, Rotation, Direction, KeyFrames)


def sampling_advice(scene: VariableScene, materials: list[Material]) -> list[str]:
    """One line or more: the sampler, and the reason.

    Where the error is everywhere and patches are cheap, no choice is worth what it costs. What is
    rare is an exception: what a light does that moves, goes out or is shut out, alone or through
    what is smooth enough for caustics. Patches that take long to trace had better be small.
    """
    lines = ["sampler=sobol: the best known where the error is everywhere and patches are cheap"]
    if causes := _rare(scene, materials):
        lines.append(
            f"method=ours_eager, if {CONCENTRATED:.0%} or more of a pilot run's loss is on the "
            f"worst 5% of its patches: {'; '.join(causes)}"
        )
    spp = scene.description.samples_per_pixel
    if spp >= WORTH_A_SETUP:
        lines.append(
            f"method=ours_small_patches with the scene's {spp} samples per pixel (budget=scarce): "
            "with equally many paths, smaller patches of more v, each at the best of four places, "
            "have less error"
        )
    if spp >= DEAR:
        lines.append(
            f"the samples per pixel of budget=machine or budget=hour instead of {spp}: more "
            "patches reduce the error more than any choice of few"
        )
    return [*lines, f"see {PAGE}"]


def _rare(scene: VariableScene, materials: list[Material]) -> list[str]:
    """Why an effect may be seen at few v only; nothing where no light and no object moves."""
    variables = scene.description.variables
    lights: list[str] = []
    others: list[str] = []
    for variable in filter(_moves_or_goes_out, variables):
        found = lights if any(map(emits, scene.owners(variable))) else others
        found.append("+".join(variable.objects))
    causes = [
        f"{', '.join(dict.fromkeys(names))} {does}"
        for names, does in ((lights, "moves or goes out"), (others, "may bar the light's way"))
        if names
    ]
    if not lights:
        return causes
    roughness = [material.front.constant_roughness for material in materials]
    if min((alpha for alpha in roughness if alpha is not None), default=1.0) <= SHINY or any(
        map(_polishes, variables)
    ):
        causes.append("smooth surfaces make caustics")
    return causes


def _moves_or_goes_out(variable: Variable) -> bool:
    if isinstance(variable, Intensity):
        return min(variable.minimum) == 0
    return isinstance(variable, MOVES)


def _polishes(variable: Variable) -> bool:
    """Whether it makes a surface smooth somewhere."""
    return isinstance(variable, Roughness) and min(variable.minimum + variable.maximum) <= SHINY
