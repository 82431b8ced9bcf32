"""Which sampler a variable scene asks for, as far as can be told before anything is rendered."""

from ngi.render.materials import Material
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

PAGE = "docs/guide/sampler.md"

CONCENTRATED = 0.3
"""Share of the loss on the worst 5 % of a pilot run's patches from which on a choice pays."""

SHINY = 0.1
"""Roughness (alpha) up to which a surface gathers light into caustics."""

DEAR = 1000
"""Samples per pixel from which on the number of patches decides, and no choice of them."""

MOVES = (Translation, Rotation, Direction, KeyFrames)


def sampling_advice(scene: VariableScene, materials: list[Material]) -> list[str]:
    """One line or more: the sampler, and the reason.

    Chosen by its true error, no patch gained anything that could be measured over a Sobol sequence
    at the sizes that were run. What is rare is the exception: what a light does that moves or goes
    out, alone or through what is smooth enough for caustics.
    """
    lines = ["sampler=sobol: no choice of patches by their error gained anything measurable"]
    if causes := _rare(scene, materials):
        lines.append(
            f"sampler=predicted_loss renderer.halves=true, where {CONCENTRATED:.0%} and more of a "
            f"pilot run's loss is on the worst 5% of its patches: {' and '.join(causes)}"
        )
    spp = scene.description.samples_per_pixel
    if spp >= DEAR:
        lines.append(
            f"renderer.samples_per_pixel=32 instead of {spp}: more patches take off more error "
            "than any choice of few"
        )
    return [*lines, f"see {PAGE}"]


def pilot_advice(worst_share: float) -> str:
    """One line: what a run says of the sampler for the next one.

    worst_share: of the loss of its new patches, see `ngi.learn.new_losses`
    """
    return (
        f"the worst 5% of the new patches had {worst_share:.0%} of the loss "
        f"(if drawn uniformly, sampler=predicted_loss pays from {CONCENTRATED:.0%} on: {PAGE})"
    )


def _rare(scene: VariableScene, materials: list[Material]) -> list[str]:
    """Why an effect may be seen at few v only; nothing where no light moves."""
    variables = scene.description.variables
    lights = [
        "+".join(variable.objects)
        for variable in variables
        if _moves_or_goes_out(variable) and any(map(emits, scene.owners(variable)))
    ]
    if not lights:
        return []
    causes = [f"{', '.join(dict.fromkeys(lights))} moves or goes out"]
    roughness = [m.constant_roughness for m in materials if m.constant_roughness is not None]
    if min(roughness, default=1.0) <= SHINY or any(map(_polishes, variables)):
        causes.append("smooth surfaces make caustics")
    return causes


def _moves_or_goes_out(variable: Variable) -> bool:
    if isinstance(variable, Intensity):
        return min(variable.minimum) == 0
    return isinstance(variable, MOVES)


def _polishes(variable: Variable) -> bool:
    """Whether it makes a surface smooth somewhere."""
    return isinstance(variable, Roughness) and variable.minimum[0] <= SHINY
