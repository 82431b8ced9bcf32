"""The parameters of a loaded scene that Mitsuba 3.9 can change, and which of them vary here.

Every parameter that `mi.traverse` offers of a plugin is named, with the properties of scene.yaml
that vary it or with the reason why none does.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain


@dataclass(frozen=True)
class Offer:
    """properties: of scene.yaml, that vary a parameter. why_not: the reason where none does."""

    properties: tuple[str, ...] = ()
    why_not: str = ""


def _by(*properties: str) -> Offer:
    return Offer(properties)


def _no(reason: str) -> Offer:
    return Offer(why_not=reason)


_NOISE = _no("it changes how noisy a rendering is, not the picture")
_COMPILED = _no(
    "Mitsuba compiles it into its kernels, so each value would take longer than a patch"
)
_UV = _no(
    "Mitsuba compiles it into its kernels; let 'texture' choose between images that are shifted"
)
_SMOOTH = _no(
    "Mitsuba compiles the eta of a smooth BSDF into its kernels; take a thindielectric or "
    "roughdielectric, or let 'material' choose between BSDFs"
)
_METAL = _no("it is a spectrum; let 'material' choose between BSDFs")
_COAT = _no("'albedo' varies its diffuse_reflectance")
_IMAGE = _no("the image of a light cannot vary; its intensity and its place can")
_SKY = _no(
    "Mitsuba computes such a sky anew in kernels of its own; vary a directional emitter's "
    "direction and an envmap's rotation"
)
_RUN = _no("a run sets it for all its images")
_STILL = _no("nothing moves while the shutter is open")
_SHIFT = _no("use look_at and fov to vary the view")
_TOPOLOGY = _no("the triangles of a mesh are fixed; key_frames moves their corners")
_COORDINATES = _no("texture coordinates are fixed; vary the image with 'texture' and 'texels'")
_RELIEF = _no("its bumps are fixed; let 'material' choose between BSDFs")
_CURVE = _no("its arrays are fixed; translation, rotation and scale move it as a whole")
_LENS = _no("only pinhole cameras are supported: buffers hold one point per pixel and ray")
_CAMERA = _no("only perspective cameras are supported")
_UNKNOWN = _no("the buffers cannot represent the albedo and roughness of such a BSDF")
_MEDIUM = _no("the buffers represent surfaces only, not media")
_COLOURED = _no("it is not one colour; 'texture' and 'texels' vary bitmaps")

_SHAPE = _by("translation", "rotation", "scale", "visibility", "shape")
_LAMP = _by("translation", "rotation", "direction")
_EMITTED = _by("intensity", "radiance")
_ALBEDO = _by("albedo", "texture", "texels")

Parameters = Mapping[str, Offer]

_EMITTERS: dict[str, Parameters] = {
    "area": {"radiance": _EMITTED},
    "point": {"position": _by("translation"), "intensity": _EMITTED},
    "spot": {
        "to_world": _LAMP,
        "intensity": _EMITTED,
        "cutoff_angle": _by("cone"),
        "beam_width": _by("cone"),
        "texture": _IMAGE,
    },
    "projector": {"to_world": _LAMP, "scale": _by("intensity"), "irradiance": _IMAGE},
    "directional": {"to_world": _by("direction", "rotation"), "irradiance": _EMITTED},
    "directionalarea": {"radiance": _EMITTED},
    "constant": {"radiance": _EMITTED},
    "envmap": {"to_world": _by("rotation"), "scale": _by("intensity"), "data": _IMAGE},
}
_SKIES = {
    "sunsky": "sun_direction latitude longitude timezone year month day hour minute second",
    "timed_sunsky": "latitude longitude timezone window_start_time window_end_time start_year "
    "start_month start_day end_year end_month end_day",
}
for _name, _own in _SKIES.items():
    _EMITTERS[_name] = {"to_world": _by("rotation")} | dict.fromkeys(
        ["turbidity", "albedo", "sky_scale", "sun_scale", *_own.split()], _SKY
    )

_SENSORS: dict[str, Parameters] = {
    "perspective": {
        "to_world": _by("look_at", "camera_path", "translation", "rotation"),
        "x_fov": _by("fov"),
        "principal_point_offset_x": _SHIFT,
        "principal_point_offset_y": _SHIFT,
        "near_clip": _COMPILED,
        "far_clip": _COMPILED,
        "shutter_open": _STILL,
        "shutter_open_time": _STILL,
        "film": _RUN,
    }
}

_INDICES = {"eta": _METAL, "k": _METAL}
_ALPHAS = {"alpha": _by("roughness"), "alpha_u": _by("alpha_u"), "alpha_v": _by("alpha_v")}
_COATING = {"diffuse_reflectance": _ALBEDO, "specular_reflectance": _COAT, "eta": _SMOOTH}
_GLASS = {"specular_reflectance": _ALBEDO, "specular_transmittance": _ALBEDO}
_PRINCIPLED = (
    "metallic specular spec_tint anisotropic sheen sheen_tint clearcoat clearcoat_gloss flatness "
    "spec_trans"
)
_BSDFS: dict[str, Parameters] = {
    "diffuse": {"reflectance": _ALBEDO},
    "plastic": _COATING,
    "roughplastic": {**_COATING, "alpha": _by("roughness")},
    "conductor": {"specular_reflectance": _ALBEDO, **_INDICES},
    "roughconductor": {"specular_reflectance": _ALBEDO, **_INDICES, **_ALPHAS},
    "dielectric": {**_GLASS, "eta": _SMOOTH},
    "thindielectric": {**_GLASS, "eta": _by("eta")},
    "roughdielectric": {**_GLASS, "eta": _by("eta"), **_ALPHAS},
    "principled": {
        "base_color": _ALBEDO,
        "roughness": _by("roughness"),
        "eta": _no("'specular' says the same, and varies"),
        **{name: _by(name) for name in _PRINCIPLED.split()},
        "main_specular_sampling_rate": _NOISE,
        "clearcoat_sampling_rate": _NOISE,
        "diffuse_reflectance_sampling_rate": _NOISE,
    },
    "twosided": {},
    "bumpmap": {"nested_texture": _RELIEF, "scale": _COMPILED},
    "normalmap": {"normalmap": _RELIEF},
}

_CUBE = {
    "vertex_positions": _by("translation", "rotation", "scale", "visibility"),
    "vertex_normals": _no("they turn with the shape"),
    "vertex_texcoords": _COORDINATES,
    "faces": _TOPOLOGY,
}
_MESH = {
    **_CUBE,
    "vertex_positions": _by("key_frames", "translation", "rotation", "scale", "visibility"),
    "vertex_normals": _by("key_frames"),
}
_PLACED = {"to_world": _SHAPE}
_ARRAYS = dict.fromkeys(("control_point_count", "segment_indices", "control_points"), _CURVE)
_SHAPES: dict[str, Parameters] = {
    **dict.fromkeys(("sphere", "rectangle", "disk", "cylinder", "instance"), _PLACED),
    "cube": _CUBE,
    **dict.fromkeys(("ply", "obj", "serialized"), _MESH),
    **dict.fromkeys(("linearcurve", "bsplinecurve"), _ARRAYS),
    "ellipsoids": dict.fromkeys(("data", "extent", "extent_adaptive_clamping"), _CURVE),
}

_TEXTURES: dict[str, Parameters] = {
    "bitmap": {"data": _by("texture", "texels"), "to_uv": _UV},
    "checkerboard": {"color0": _by("color0"), "color1": _by("color1"), "to_uv": _COMPILED},
    "mesh_attribute": {"scale": _COMPILED},
    "volume": {"volume": _COLOURED},
}

GROUPS: dict[str, dict[str, Parameters]] = {
    "emitters": _EMITTERS,
    "cameras": _SENSORS,
    "BSDFs": _BSDFS,
    "shapes": _SHAPES,
    "textures": _TEXTURES,
}
"""Plugins of a scene, and each one's own parameters without the '.value' of what holds a number."""

EVERYWHERE: dict[str, Parameters] = {
    "emitters": {"sampling_weight": _NOISE},
    "shapes": {"silhouette_sampling_weight": _NOISE},
}
"""Parameters that all plugins of a group have."""

REFUSED: dict[Offer, str] = {
    _LENS: "thinlens",
    _CAMERA: "orthographic distant radiancemeter irradiancemeter batch",
    _UNKNOWN: "blendbsdf mask null principledthin pplastic hair measured measured_polarized "
    "retarder polarizer circular",
    _MEDIUM: "homogeneous heterogeneous hg isotropic rayleigh sggx tabphase blendphase constvolume "
    "gridvolume",
    _CURVE: "sdfgrid ellipsoidsmesh",
}
"""Plugins of which nothing varies."""

_OTHER_NAMES = {
    "aperture_radius": _LENS,
    "focus_distance": _LENS,
    "texture_offset": _UV,
    "weight": _UNKNOWN,
    "opacity": _UNKNOWN,
    "sigma_t": _MEDIUM,
    "g": _MEDIUM,
}
"""Parameters of refused plugins, and what users call others."""


def advice(name: str) -> str:
    """What to do about a property that is one of Mitsuba's parameters; '' for one that is not."""
    name = name.removesuffix(".value").removesuffix(".data")
    plugins = chain.from_iterable(group.values() for group in GROUPS.values())
    everything = [*plugins, *EVERYWHERE.values(), _OTHER_NAMES]
    found = [parameters[name] for parameters in everything if name in parameters]
    properties = dict.fromkeys(p for offer in found for p in offer.properties)
    if properties:
        return f"Mitsuba's '{name}' varies as {', '.join(properties)}"
    return "; ".join(dict.fromkeys(f"'{name}' does not vary: {o.why_not}" for o in found))
