"""Texts about scenes: what varies and what a run leaves out, or what could vary."""

from pathlib import Path

from ngi.files.durable import write_atomically
from ngi.render.materials import materials_in
from ngi.render.needs import buffer_needs, buffers_are_static, direct_need, needed_layout
from ngi.render.obstacles import obstacles
from ngi.render.projection import require_perspective
from ngi.render.sampling_advice import sampling_advice
from ngi.scene.arrangement import STATIC
from ngi.scene.clearance import camera_problems, meeting_views, out_of_bounds
from ngi.scene.description import SceneDescription
from ngi.scene.loading import load
from ngi.scene.scene_files import read_scene_file
from ngi.scene.starter import candidates, starter_yaml
from ngi.scene.variable_scene import VariableScene


def describe_scene(description: SceneDescription) -> tuple[str, list[str]]:
    """A text about a variable scene, and what is wrong with it."""
    scene = VariableScene(description)
    require_perspective(scene.scene, document=description.document)
    lines = [
        f"{description.name}: {description.dimensions} dimensions, {description.document.path}",
        f"  {description.samples_per_pixel} samples per pixel, max_depth {description.max_depth}",
        "",
        "variables (component of v: value at 0 ... at 1):",
    ]
    for variable, part in description.parts():
        names = ["+".join(variable.objects) + "." + variable.kind, *variable.components]
        one = part.stop == part.start + 1
        numbers = f"v[{part.start}]" if one else f"v[{part.start}:{part.stop}]"
        parts = ", ".join(filter(None, names[1:6])) + (", ..." if len(names) > 6 else "")
        lines.append(
            f"  {numbers:>9}  {names[0]}{f' ({parts})' if parts else ''}: {variable.range}"
        )
    lines += ["", "buffers:"]
    materials = materials_in(description.document, scene.bsdfs())
    needs = buffer_needs(scene, materials)
    for need in needs:
        lines.append(f"  {need.buffer:>9}  {'kept' if need.needed else 'left out'}: {need.why}")
    direct = direct_need(scene)
    kept = "kept with renderer.direct=traced" if direct.needed else "left out"
    lines.append(f"  {direct.buffer:>9}  {kept}: {direct.why}")
    if buffers_are_static(scene, needed_layout(needs)):
        lines.append("  no variable changes a buffer: they are rendered once per resolution")
    lines += ["", "geometry:", f"  {_geometry(scene)}"]
    lines += [f"  note: {line}" for line in out_of_bounds(scene)]
    lines += ["", "sampling:", *(f"  {line}" for line in sampling_advice(scene, materials))]
    return "\n".join(lines), meeting_views(description) or camera_problems(scene)


def describe_file(path: Path) -> str:
    """What could vary in a plain Mitsuba file; writes a scene.yaml beside it, if there is none."""
    document = read_scene_file(path)
    scene = load(document)
    found, nameless = candidates(document, scene)
    properties: dict[str, list[str]] = {}
    for candidate in found:
        properties.setdefault(candidate.object, []).append(candidate.property)
    lines = [f"{path}: a plain Mitsuba scene. What can vary:"]
    lines += [f"  {name}: {', '.join(kinds)}" for name, kinds in properties.items()]
    if others := [sensor.id() for sensor in scene.sensors()[1:]]:
        lines.append(f"  not rendered: {', '.join(others)}; of several cameras the first one is")
    if nameless:
        lines.append(f"  and {nameless} more object(s) without an id: give them one to vary them")
    found_wrong = obstacles(scene, document=document)
    lines += [f"  cannot be trained on as it is: {obstacle}" for obstacle in found_wrong]
    target = path.parent / "scene.yaml"
    if target.exists():
        lines += ["", f"{target} is there: describe its folder {path.parent}"]
    else:
        write_atomically(target, starter_yaml(document, scene, found).encode())
        lines += ["", f"wrote {target}; adjust it, then describe its folder {path.parent}"]
    return "\n".join(lines)


def _geometry(scene: VariableScene) -> str:
    shapes = {shape.id() for shape in scene.shapes}
    moving = sorted(scene.moving & shapes)
    if not moving:
        return "nothing moves: the acceleration structure is never rebuilt"
    rest = "; everything else is behind one instance" if STATIC in shapes else ""
    return f"moves: {', '.join(moving)}{rest}"
