"""What Mitsuba offers of every plugin: all of it is named, and what is said of it is true."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
import yaml

from ngi.machine.backend import a_worker_thread, activate, mi
from ngi.render.exr import write_exr
from ngi.scene import KINDS, read_scene
from ngi.scene.offered import EVERYWHERE, GROUPS, REFUSED, advice
from ngi.scene.variable_scene import VariableScene
from tests.scene.stage import write_ply

INTEGRATORS = "aov depth direct moment path ptracer stokes volpath volpathmis"
SAMPLERS = "independent ldsampler multijitter orthogonal stratified"
FILMS = "box catmullrom gaussian lanczos mitchell tent hdrfilm specfilm"
SPECTRA = "blackbody d65 irregular rawconstant regular srgb uniform"
CONTAINERS = "blender merge shapegroup"
NO_OBJECTS = f"{INTEGRATORS} {SAMPLERS} {FILMS} {SPECTRA} {CONTAINERS}"
"""Plugins that are no object of a scene, or whose parts are."""

PICTURE = '<texture type="bitmap" name="{}"><string name="filename" value="a.exr"/></texture>'
SKY = '<string name="filename" value="a.exr"/>'
MESH = '<string name="filename" value="a.ply"/>'
CURVE = '<string name="filename" value="curve.txt"/>'
VOLUME = '<volume type="constvolume" name="volume"><rgb name="value" value="0.5"/></volume>'
DIFFUSE = '<bsdf type="diffuse"/>'
RGB = '<rgb name="{}" value="0.5, 0.4, 0.3"/>'.format
NUMBER = '<float name="{}" value="{}"/>'.format
SPECULAR = RGB("specular_reflectance")
COAT = RGB("diffuse_reflectance") + SPECULAR
GLASS = SPECULAR + RGB("specular_transmittance")
ANISOTROPIC = NUMBER("alpha_u", 0.1) + NUMBER("alpha_v", 0.2)
PRINCIPLED = (
    *("metallic", "specular", "spec_tint", "anisotropic", "sheen", "sheen_tint", "clearcoat"),
    *("clearcoat_gloss", "flatness", "spec_trans"),
)

INSIDE = {
    "area": (RGB("radiance"),),
    "point": (RGB("intensity"),),
    "spot": (RGB("intensity") + PICTURE.format("texture"),),
    "projector": (PICTURE.format("irradiance") + NUMBER("fov", 30),),
    "directional": (RGB("irradiance"),),
    "directionalarea": (RGB("radiance"),),
    "constant": (RGB("radiance"),),
    "envmap": (SKY,),
    "perspective": (NUMBER("fov", 40),),
    "diffuse": (RGB("reflectance"),),
    "plastic": (COAT,),
    "roughplastic": (COAT,),
    "conductor": (SPECULAR,),
    "roughconductor": (SPECULAR, ANISOTROPIC),
    "dielectric": (GLASS, SPECULAR),
    "thindielectric": (GLASS, SPECULAR),
    "roughdielectric": (GLASS, SPECULAR, ANISOTROPIC),
    "principled": (
        RGB("base_color") + "".join(NUMBER(name, 0.3) for name in PRINCIPLED),
        RGB("base_color") + NUMBER("eta", 1.4),
    ),
    "twosided": (DIFFUSE,),
    "bumpmap": (DIFFUSE + PICTURE.format("bump"),),
    "normalmap": (DIFFUSE + PICTURE.format("normalmap"),),
    "ply": (MESH,),
    "linearcurve": (CURVE,),
    "bsplinecurve": (CURVE,),
    "bitmap": (SKY,),
    "checkerboard": (RGB("color0") + RGB("color1"),),
    "mesh_attribute": ('<string name="name" value="vertex_color"/>',),
    "volume": (VOLUME,),
}
"""What is written into an element of a plugin, so that between them it has all its parameters."""

TAG = {"emitters": "emitter", "cameras": "sensor", "BSDFs": "bsdf", "shapes": "shape"}
ELSEWHERE = ("obj", "serialized", "ellipsoids", "instance")
"""Plugins that are read in other ways, but have the parameters of one that is tried."""


@pytest.fixture
def folder(tmp_path) -> Path:
    activate("scalar")
    generator = np.random.default_rng(0)
    for name in "ab":
        image = generator.random((8, 16, 3)).astype(np.float32)
        write_exr(tmp_path / f"{name}.exr", torch.from_numpy(image))
        corners = generator.random((3, 3))
        write_ply(tmp_path / f"{name}.ply", corners, [(0, 1, 2)], normals=np.eye(3) + corners)
    (tmp_path / "curve.txt").write_text("".join(f"{i} 0 0 0.1\n" for i in range(4)))
    return tmp_path


def element(group: str, plugin: str, inside: str) -> str:
    tag = TAG.get(group, "texture")
    name = ' name="reflectance"' if group == "textures" else ""
    own = f'<{tag} type="{plugin}" id="it"{name}>{inside}</{tag}>'
    if group == "textures":
        return f'<bsdf type="diffuse" id="paint">{own}</bsdf>'
    if plugin in ("area", "directionalarea"):
        return f'<shape type="rectangle" id="lamp">{own}</shape>'
    return own


def own_parameters(scene: mi.Scene) -> set[str]:
    """Of the object 'it', by their names; those of a texture in it count as the texture's."""
    parameters = mi.traverse(scene)
    parents = parameters.hierarchy
    # Of a bitmap, Mitsuba makes an object that has no id.
    (it,) = [n for n in parents if n.id() == "it"] or [
        n for n in parents if n.class_name().startswith("BitmapTexture")
    ]
    found = set()
    for key, (_, _, node, _) in parameters.properties.items():
        names = key.split(".")
        while node not in (it, None):
            node, names = parents[node][0], names[:-1]
            if node is not it and isinstance(node, mi.BSDF | mi.Shape | mi.Emitter):
                break
        if node is it:
            found.add(names[-1])
    return found


PLUGINS = [
    (group, plugin, parameters)
    for group, plugins in GROUPS.items()
    for plugin, parameters in plugins.items()
]


@pytest.mark.parametrize(("group", "plugin", "parameters"), PLUGINS)
def test_every_parameter_is_named(folder, group, plugin, parameters) -> None:
    if plugin in ELSEWHERE:
        pytest.skip("as another plugin")
    found = set()
    for inside in INSIDE.get(plugin, ("",)):
        text = f'<scene version="3.0.0">{element(group, plugin, inside)}</scene>'
        path = folder / "scene.xml"
        path.write_text(text)
        with a_worker_thread():
            scene = mi.load_file(str(path), optimize=False)
        found |= own_parameters(scene)
    assert found - set(EVERYWHERE.get(group, {})) == set(parameters)


def test_every_plugin_is_named() -> None:
    files = (Path(mi.__file__).parent / "plugins").glob("*.so")
    named = {plugin for _, plugin, _ in PLUGINS} | set(" ".join(REFUSED.values()).split())
    assert {file.stem for file in files} == named | set(NO_OBJECTS.split())


def test_every_kind_varies_something_that_mitsuba_offers() -> None:
    used = {p for _, _, o in PLUGINS for offer in o.values() for p in offer.properties}
    assert set(KINDS) - used == {"material"}, "a shape has it, and no parameter of a plugin is it"
    assert used <= set(KINDS)


RANGE = {"minimum": 0.2, "maximum": 0.8}
COLOURS = {"minimum": [0.1, 0.2, 0.3], "maximum": [0.4, 0.6, 0.8]}
OFFSETS = {"minimum": [0, 0, 0], "maximum": [1, 2, 3]}
VIEWS = [[0, 1, 4, 0, 1, 0], [1, 1.5, 3, 0, 1, 0]]
ENTRIES = {
    "translation": OFFSETS,
    "rotation": {"axis": [1, 2, 3], "minimum": 10, "maximum": 80},
    "scale": {"pivot": [1, 0, 0], "minimum": 0.5, "maximum": 2},
    "visibility": {},
    "shape": {"choices": ["other", "it"]},
    "key_frames": {"files": ["a.ply", "b.ply"]},
    "look_at": {"minimum": VIEWS[0], "maximum": [1, 2, 5, 1, 2, 1]},
    "camera_path": {"keys": VIEWS},
    "direction": {"minimum": [0, 10], "maximum": [90, 80]},
    "fov": {"minimum": 20, "maximum": 60},
    "cone": {"minimum": [30, 5], "maximum": [50, 25]},
    "eta": {"minimum": 1.2, "maximum": 1.9},
    "texture": {"choices": ["a.exr", "b.exr"]},
    "texels": {"size": [8, 16], **RANGE},
    **dict.fromkeys(("albedo", "radiance", "color0", "color1"), COLOURS),
}
PARENT = {"color0": "paint", "color1": "paint", "texture": "paint", "texels": "paint"}
"""Of a texture in a BSDF, whose id is the BSDF's."""

EFFECTS = [
    (group, plugin, parameter, name)
    for group, plugin, parameters in PLUGINS
    for parameter, offer in parameters.items()
    for name in offer.properties
    if plugin not in ELSEWHERE
]


def scene_of(folder, group, plugin, parameter, name) -> list[VariableScene]:
    """As many scenes as the plugin has ways of being written in which the property can vary."""
    image = name in ("texture", "texels") and group == "BSDFs"
    insides = (PICTURE.format(parameter),) if image else INSIDE.get(plugin, ("",))
    object_id = "seat" if name == "shape" else PARENT.get(name, "it") if group != "BSDFs" else "it"
    content = {
        "name": "it",
        "scene": "scene.xml",
        "samples_per_pixel": 8,
        "max_depth": -1,
        "bounds": {"minimum": [-9, -9, -9], "maximum": [9, 9, 9]},
        "variables": [{"object": object_id, "property": name, **ENTRIES.get(name, RANGE)}],
    }
    (folder / "scene.yaml").write_text(yaml.safe_dump(content))
    made = []
    for inside in insides:
        (folder / "scene.xml").write_text(
            f'<scene version="3.0.0">{element(group, plugin, inside)}<integrator type="path"/>'
            '<sensor type="perspective"/><shape type="sphere" id="other"/></scene>'
        )
        try:
            made.append(VariableScene(read_scene(folder)))
        except ValueError as error:
            assert "has no parameter" in str(error)  # noqa: PT017
    return made


@pytest.mark.parametrize(("group", "plugin", "parameter", "name"), EFFECTS)
def test_a_property_changes_the_parameter_that_it_is_said_to(
    folder, group, plugin, parameter, name
) -> None:
    def values():
        parameters = mi.traverse(scene.scene)
        return {key: str(parameters[key]) for key in parameters.properties}

    made = scene_of(folder, group, plugin, parameter, name)
    assert made
    changed = []
    for scene in made:
        scene.apply([0.1] * scene.description.dimensions)
        before = values()
        scene.apply([0.9] * scene.description.dimensions)
        changed += [key for key, value in values().items() if value != before[key]]
    # What moves a mesh as a whole makes it an instance.
    named = [key for key in changed if parameter in key.split(".") or plugin in ("cube", "ply")]
    assert named


REFUSALS = sorted(
    {
        (name, offer.why_not)
        for _, _, parameters in PLUGINS
        for name, offer in [*parameters.items(), *EVERYWHERE["emitters"].items()]
        if not offer.properties and name not in KINDS
    }
)


OF_REFUSED_PLUGINS = [
    ("opacity", "the buffers cannot represent the albedo and roughness of such a BSDF"),
    ("focus_distance", "only pinhole cameras are supported"),
    ("sigma_t", "the buffers represent surfaces only, not media"),
]


@pytest.mark.parametrize(("name", "reason"), [*REFUSALS, *OF_REFUSED_PLUGINS])
def test_what_does_not_vary_is_refused_with_the_reason(tmp_path, name, reason) -> None:
    (tmp_path / "scene.xml").write_text('<scene version="3.0.0"><integrator type="path"/></scene>')
    content = {
        "name": "it",
        "scene": "scene.xml",
        "samples_per_pixel": 8,
        "max_depth": -1,
        "bounds": {"minimum": [0, 0, 0], "maximum": [1, 1, 1]},
        "variables": [{"object": "it", "property": name, "minimum": 0, "maximum": 1}],
    }
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump(content))
    message = rf"scene\.yaml: variables\[0\]\.property is '{name}'; .*"
    with pytest.raises(ValueError, match=message) as error:
        read_scene(tmp_path)
    varies = f"Mitsuba's '{name}' varies as "
    assert (varies in str(error.value)) != (f"'{name}' does not vary: " in str(error.value))
    assert varies in str(error.value) or reason in str(error.value)


def test_other_names_of_what_varies_are_told() -> None:
    assert advice("x_fov") == "Mitsuba's 'x_fov' varies as fov"
    assert advice("position") == "Mitsuba's 'position' varies as translation"
    assert (
        advice("reflectance.value") == "Mitsuba's 'reflectance' varies as albedo, texture, texels"
    )
    assert advice("texture_offset").endswith("choose between images that are shifted")
    assert advice("nonsense") == ""
