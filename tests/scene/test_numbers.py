"""Numbers of BSDFs that vary, against a scene that was loaded with the value written into it."""

import numpy as np
import pytest
import yaml

from ngi.machine.backend import activate, mi
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene

NUMBER = '<float name="{}" value="{}"/>'.format
PRINCIPLED = (
    *("metallic", "specular", "spec_tint", "anisotropic", "sheen", "sheen_tint", "clearcoat"),
    *("clearcoat_gloss", "flatness", "spec_trans"),
)
METAL = {"alpha_u": 0.3, "alpha_v": 0.5}
BOARD = {"color0": (0.2, 0.3, 0.4), "color1": (0.7, 0.6, 0.5)}

CASES = [
    *(("principled", name, 0.2, 0.7) for name in PRINCIPLED),
    *(("roughconductor", name, 0.2, 0.7) for name in METAL),
    *(("roughdielectric", name, 0.2, 0.7) for name in METAL),
    ("roughdielectric", "eta", 1.3, 1.8),
    ("thindielectric", "eta", 1.3, 1.8),
    *(("checkerboard", name, (0.1, 0.2, 0.3), (0.9, 0.5, 0.6)) for name in BOARD),
]
"""Plugin, number, and two values of it."""


def element(plugin, name, value) -> str:
    """A BSDF 'it' with one of its numbers given; the others are not at the ends of their ranges."""
    if plugin == "checkerboard":
        colours = "".join(
            f'<rgb name="{key}" value="{", ".join(map(str, colour))}"/>'
            for key, colour in (BOARD | {name: value}).items()
        )
        board = f'<texture type="checkerboard" name="reflectance">{colours}</texture>'
        return f'<bsdf type="diffuse" id="it">{board}</bsdf>'
    numbers = {"int_ior": value, "ext_ior": 1} if name == "eta" else METAL | {name: value}
    inside = ""
    if plugin == "principled":
        numbers = dict.fromkeys(PRINCIPLED, 0.4) | {name: value}
        inside = '<rgb name="base_color" value="0.7, 0.2, 0.4"/>'
    inside += "".join(NUMBER(key, given) for key, given in numbers.items())
    return f'<bsdf type="{plugin}" id="it">{inside}</bsdf>'


def answers(scene) -> np.ndarray:
    """What the BSDF 'it' answers at random points, for random directions to and from them."""
    (it,) = [node for node in mi.traverse(scene).hierarchy if node.id() == "it"]
    generator = np.random.default_rng(0)
    values = []
    for _ in range(60):
        hit = mi.SurfaceInteraction3f()
        hit.uv = mi.Point2f(*generator.random(2))
        directions = generator.normal(size=(2, 3))
        hit.wi, wo = (
            mi.Vector3f(*d) for d in directions / np.linalg.norm(directions, axis=1)[:, None]
        )
        value, density = it.eval_pdf(mi.BSDFContext(), hit, wo)
        sample, weight = it.sample(mi.BSDFContext(), hit, generator.random(), mi.Point2f(0.3, 0.6))
        values.append([*value, density, *weight, *sample.wo])
    return np.array(values, dtype=np.float64)


@pytest.mark.parametrize(("plugin", "name", "low", "high"), CASES)
def test_a_number_equals_the_one_written_into_the_scene(tmp_path, plugin, name, low, high) -> None:
    def written(value) -> str:
        return (
            '<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"/>'
            f'<shape type="sphere"><ref id="it"/></shape>{element(plugin, name, value)}</scene>'
        )

    activate("scalar")
    low, high = (np.array(end, dtype=float) for end in (low, high))
    (tmp_path / "scene.xml").write_text(written((low + high) / 2))
    content = {
        "name": "it",
        "scene": "scene.xml",
        "samples_per_pixel": 8,
        "max_depth": -1,
        "bounds": {"minimum": [-1, -1, -1], "maximum": [1, 1, 1]},
        "variables": [
            {"object": "it", "property": name, "minimum": low.tolist(), "maximum": high.tolist()}
        ],
    }
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump(content))
    scene = VariableScene(read_scene(tmp_path))
    found = []
    for u in (1, 0, 0.25):
        scene.apply([u] * scene.description.dimensions)
        found.append(answers(scene.scene))
        value = low + u * (high - low)
        expected = answers(mi.load_string(written(value), optimize=False))
        np.testing.assert_allclose(found[-1], expected, rtol=1e-4, atol=1e-6)
    assert not np.allclose(found[0], found[1], rtol=1e-3), "the comparison is blind"


ETA = [
    ("dielectric", "'it' (SmoothDielectric) has no parameter eta.value or eta"),
    ("plastic", "'it' (SmoothPlastic) has no parameter"),
    ("conductor", "'it' (SmoothConductor) has no parameter"),
]


@pytest.mark.parametrize(("plugin", "message"), ETA)
def test_an_index_that_mitsuba_compiles_into_its_kernels_does_not_vary(
    tmp_path, plugin, message
) -> None:
    activate("scalar")
    (tmp_path / "scene.xml").write_text(
        '<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"/>'
        f'<shape type="sphere"><bsdf type="{plugin}" id="it"/></shape></scene>'
    )
    (tmp_path / "scene.yaml").write_text(
        "{name: it, scene: scene.xml, samples_per_pixel: 8, max_depth: -1, bounds: {minimum: "
        "[0, 0, 0], maximum: [1, 1, 1]}, variables: [{object: it, property: eta, minimum: 1.2, "
        "maximum: 1.5}]}"
    )
    with pytest.raises(ValueError, match="that varies") as error:
        VariableScene(read_scene(tmp_path))
    assert message in str(error.value)
    assert "ThinDielectric or RoughDielectric" in str(error.value)
