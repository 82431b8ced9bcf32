"""What could vary in a plain Mitsuba scene, and a scene.yaml to start from."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import dataclass

import numpy as np
import yaml

from ngi.machine.backend import mi
from ngi.scene import transforms
from ngi.scene.kinds.appearance import PLASTICS
from ngi.scene.scene_files import SceneFile, integrator_max_depth
from ngi.scene.scene_parameters import EMISSIONS
from ngi.scene.variable import Values

FACTOR = ", minimum: 0.5, maximum: 2"
Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
"""What scenes call up."""
_AUTOMATIC_ID = re.compile(r"^(_|object_\d|[a-z]+_0x|__)")


@dataclass(frozen=True)
class Candidate:
    """A property of an object that could vary, as an entry of scene.yaml."""

    object: str
    property: str
    entry: str


def candidates(document: SceneFile, scene: mi.Scene) -> tuple[list[Candidate], int]:
    """Everything that could vary, in the order of the file, and the number of objects that could
    but have no id.

    document: the Mitsuba file, from which scene was loaded
    Raises ValueError where there is no shape.
    """
    if not scene.bbox().valid():
        raise ValueError(f"{document.path}: it has no shape, so that there is nothing to see")
    hierarchy = mi.traverse(scene).hierarchy
    found: list[Candidate] = []
    nameless = 0
    for node, (parent, _) in hierarchy.items():
        # Part of a group, of a lamp or of a wrapped BSDF, which stands for it; a shape's own BSDF
        # is an object by itself.
        whole = mi.BSDF if isinstance(node, mi.BSDF) else mi.Shape | mi.BSDF
        if isinstance(parent, whole):
            continue
        entries = _entries(node, document, scene)
        if not entries:
            continue
        if not node.id() or _AUTOMATIC_ID.match(node.id()):
            nameless += 1
            continue
        for name, rest in entries.items():
            entry = f"{{object: {_word(node.id())}, property: {name}{rest}}}"
            found.append(Candidate(node.id(), name, entry))
    return found, nameless


def starter_yaml(document: SceneFile, scene: mi.Scene, found: list[Candidate]) -> str:
    """The text of a scene.yaml: the camera or else the first candidate varies, the rest is there
    as comments.

    document: the Mitsuba file, from which scene was loaded; found: its candidates.
    """
    folder_name = document.path.resolve().parent.name
    low, high = transforms.thickened(*map(np.array, _bounds(scene)))
    active = next((c for c in found if c.property == "look_at"), found[0] if found else None)
    if active is None:
        raise ValueError(f"{document.path}: no object with an id can vary; give ids to its objects")
    lines = [
        "# What varies. Adjust the ranges, uncomment what should vary, delete the rest.",
        f"# Check it: ngi describe {shlex.quote(str(document.path.parent))}",
        f"name: {_word(folder_name)}",
        f"scene: {_word(document.path.name)}",
        f"samples_per_pixel: {_samples(document, scene)}  # of training patches "
        "with budget=scarce or paper; other budgets have their own",
        f"max_depth: {integrator_max_depth(document)}",
        "# Everything that the camera can see, over the whole range of the variables.",
        f"bounds: {{minimum: {_list(low)}, maximum: {_list(high)}}}",
        "variables:",
        *(f"  {'' if c is active else '# '}- {c.entry}" for c in found),
        "# camera_path: key frames of v; hard_frames: ten v to test on. If left out, they are",
        "# spread evenly over the hypercube.",
    ]
    return "\n".join(lines) + "\n"


def _samples(document: SceneFile, scene: mi.Scene) -> int:
    """As the file says, if it does: a sampler of which it says nothing has four."""
    if document.root.find("sensor/sampler/integer[@name='sample_count']") is None:
        return 64
    count: int = scene.sensors()[0].sampler().sample_count()
    return count if count > 1 else 64


def _word(text: str) -> str:
    """Text as YAML reads it again, in braces too: in quotes where it would be something else."""
    plain = re.fullmatch(r"[A-Za-z][\w./-]*", text) and yaml.safe_load(text) == text
    return text if plain else json.dumps(text)


def _entries(node: mi.Object, document: SceneFile, scene: mi.Scene) -> dict[str, str]:
    """Property -> the rest of its entry, with a range to start from."""
    if isinstance(node, mi.Sensor):
        if node != scene.sensors()[0] or node not in _cameras(scene):  # it is not rendered
            return {}
        return {"look_at": _views(node, scene), **_path(scene), **_field_of_view(node)}
    up = _up(scene)
    if isinstance(node, mi.Emitter):
        return _light(node, _step(scene), up)
    if isinstance(node, mi.BSDF):
        return _surface(node)
    if not isinstance(node, mi.Shape) or node.class_name().startswith("ShapeGroup"):
        return {}
    pivot = _pivot(document, node)
    entries = {
        "translation": _offsets(_step(scene), up),
        "rotation": f", axis: {_list(up)}{pivot}, minimum: -30, maximum: 30",
        "scale": f"{pivot}, minimum: 0.8, maximum: 1.2",
    }
    return entries | (_brightness(node.emitter()) if node.is_emitter() else {"visibility": ""})


def _pivot(document: SceneFile, shape: mi.Shape) -> str:
    """The middle of a mesh that is placed by its corners: without it, it turns about the world's
    origin. What has a to_world turns about the origin of that.
    """
    of_it = (each for each in document.root.iter("shape") if each.get("id") == shape.id())
    written = next(of_it, None)
    if not shape.is_mesh() or written is None or written.find("transform") is not None:
        return ""
    return f", pivot: {_list(np.ravel(shape.bbox().center()))}"


def _light(emitter: mi.Emitter, step: float, up: Values) -> dict[str, str]:
    kind = emitter.class_name()
    if kind == "DirectionalEmitter":
        return {"direction": _aims(emitter), "intensity": FACTOR}
    turned = {"rotation": f", axis: {_list(up)}, minimum: 0, maximum: 360"}
    if kind == "EnvironmentMapEmitter":
        return {**turned, "intensity": FACTOR}
    if "sky" in kind.lower():
        return turned
    entries = _brightness(emitter)
    if kind in ("PointLight", "SpotLight", "Projector"):
        entries["translation"] = _offsets(step, up)
    if kind in ("SpotLight", "Projector"):
        entries["direction"] = _aims(emitter)
    if kind == "SpotLight":
        cutoff, beam = (_number(emitter, name) for name in ("cutoff_angle", "beam_width"))
        wider = min(1.5 * cutoff, 180)
        entries["cone"] = f", minimum: {_list([cutoff, beam])}, maximum: {_list([wider, beam])}"
    return entries


def _brightness(emitter: mi.Emitter) -> dict[str, str]:
    """Of what emits the same everywhere; a bitmap of radiance has no factor."""
    constant = any(key in mi.traverse(emitter) for key in EMISSIONS)
    return {"intensity": FACTOR} if constant else {}


def _aims(emitter: mi.Emitter) -> str:
    """15 degrees about the authored direction; see `ngi.scene.kinds.view.Direction`."""
    x, y, z = -_to_world(emitter)[:3, 2]
    angles = np.degrees([np.arctan2(x, z), np.arctan2(y, np.hypot(x, z))])
    return f", minimum: {_list(angles - 15)}, maximum: {_list(angles + 15)}"


def _field_of_view(sensor: mi.Sensor) -> dict[str, str]:
    if sensor.class_name() != "PerspectiveCamera":
        return {}
    fov = _number(sensor, "x_fov")
    return {"fov": f", minimum: {0.75 * fov:.4g}, maximum: {min(1.25 * fov, 179):.4g}"}


def _number(node: mi.Object, name: str) -> float:
    return float(np.ravel(mi.traverse(node)[name])[0])


def _step(scene: mi.Scene) -> float:
    """A tenth of the scene's size."""
    return float(np.linalg.norm(np.subtract(*_bounds(scene)))) / 10


def _offsets(step: float, up: Values) -> str:
    """In both horizontal directions."""
    return f", minimum: {_list(-step * (1 - up))}, maximum: {_list(step * (1 - up))}"


def _surface(bsdf: mi.BSDF) -> dict[str, str]:
    """By the names of the BSDF's parameters, as `ngi.scene.kinds.appearance` looks for them."""
    entries = {}
    parameters = mi.traverse(bsdf)
    coated = any(node.class_name() in PLASTICS for node in parameters.hierarchy)
    for key in parameters.properties:
        if coated and re.search(r"specular_reflectance\.\w+$", key):
            continue  # it is the coat's
        if re.search(r"(reflectance|transmittance|base_color)\.value$", key):
            if np.size(parameters[key]) != 3:
                continue  # one number: authored as <spectrum>, or left out
            entries["albedo"] = ", minimum: [0.1, 0.1, 0.1], maximum: [0.9, 0.9, 0.9]"
        elif re.search(r"(reflectance|base_color)\.data$", key):
            entries["texture"] = ", choices: [FIRST.jpg, SECOND.jpg]"
        elif re.search(r"(^|\.)(alpha|alpha\.value|roughness\.value)$", key):
            entries["roughness"] = ", minimum: 0.05, maximum: 0.5"
    return entries


def _views(sensor: mi.Sensor, scene: mi.Scene) -> str:
    """A camera box of a tenth of the scene about the authored view."""
    up, view = _up(scene), _view(sensor, scene)
    low, high = map(np.array, _bounds(scene))
    reach = np.tile((high - low) / 20, 2)
    reach[3:][up > 0] = 0  # the target's height stays, as in the paper's scenes
    return f", minimum: {_list(view - reach)}, maximum: {_list(view + reach)}{_up_option(up)}"


def _path(scene: mi.Scene) -> dict[str, str]:
    """Through the views of all cameras, where there are several: only the first one is rendered."""
    views = [_list(_view(camera, scene)) for camera in _cameras(scene)]
    keys = f", keys: [{', '.join(views)}]{_up_option(_up(scene))}"
    return {"camera_path": keys} if len(views) > 1 else {}


def _cameras(scene: mi.Scene) -> list[mi.Sensor]:
    """Sensors that stand somewhere; others measure what a shape receives."""
    return [sensor for sensor in scene.sensors() if "to_world" in mi.traverse(sensor)]


def _view(camera: mi.Sensor, scene: mi.Scene) -> Values:
    """[6]: origin and target, a third of the scene away."""
    to_world, distance = _to_world(camera), np.linalg.norm(np.subtract(*_bounds(scene))) / 3
    origin = to_world[:3, 3]
    return np.concatenate([origin, origin + distance * to_world[:3, 2]])


def _up(scene: mi.Scene) -> Values:
    """Of y and z the one with which a camera that looks where the first one does is as upright, and
    along which it does not look: of that nothing can be told.
    """
    if not (cameras := _cameras(scene)):
        return Y
    _, upwards, forward, _ = _to_world(cameras[0])[:3].T

    def agreement(up: Values) -> float:
        found = transforms.look_at(np.zeros(3), forward, up)[:3, 1] @ upwards
        return round(float(found), 6) - (np.linalg.norm(np.cross(up, forward)) < 1e-3)

    return max((Y, Z), key=agreement)  # y where both are as good


def _up_option(up: Values) -> str:
    return "" if up is Y else f", up: {_list(up)}"


def _to_world(node: mi.Object) -> Values:
    """[4, 4]"""
    return np.array(mi.traverse(node)["to_world"].matrix, dtype=np.float64).reshape(4, 4)


def _bounds(scene: mi.Scene) -> tuple[list[float], list[float]]:
    box = scene.bbox()
    return [float(x) for x in np.ravel(box.min)], [float(x) for x in np.ravel(box.max)]


def _list(values: object) -> str:
    numbers = (float(f"{x:.4g}") + 0.0 for x in np.ravel(np.array(values, dtype=np.float64)))
    # without exponents, which YAML reads as text where they lack a point or a sign
    return "[" + ", ".join(np.format_float_positional(x, trim="-") for x in numbers) + "]"
