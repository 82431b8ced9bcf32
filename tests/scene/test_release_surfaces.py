"""BSDFs of the tagged format: their colours, roughness and textures at some v."""

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from ngi.machine.backend import activate, mi
from ngi.render.exr import write_exr
from tests.scene.release_files import WALL, WHITE, Loaded, read, tags


@pytest.fixture(autouse=True)
def _variant():
    activate("scalar")


@pytest.mark.parametrize(
    ("kind", "authored", "key"),
    [
        ("diffuse", WHITE, "reflectance"),
        ("diffuse", "", "reflectance"),
        ("diffuse", '<spectrum name="reflectance" value="0.3"/>', "reflectance"),
        ("roughplastic", "", "diffuse_reflectance"),
        ("roughconductor", "", "specular_reflectance"),
        ("twosided", f'<bsdf type="diffuse">{WHITE}</bsdf>', "reflectance"),
    ],
)
def test_colour_of_a_bsdf(tmp_path, kind, authored, key) -> None:
    body = WALL.format(kind, authored + tags(3, "0.1, 0.2, 0.3", "0.5, 0.25, 0"))
    loaded = Loaded(read(tmp_path, body))
    parameters = loaded.at(1, 0.5, 1)
    (name,) = [k for k in parameters.keys() if k.endswith(f"{key}.value")]  # noqa: SIM118
    assert_allclose(np.array(parameters[name]).reshape(-1), (0.6, 0.325, 0.3), rtol=1e-6)


@pytest.mark.parametrize("kind", ["dielectric", "thindielectric", "roughdielectric"])
def test_the_colour_of_glass_is_that_of_its_reflection(tmp_path, kind) -> None:
    """What it transmits stays as it is."""
    authored = '<rgb name="specular_transmittance" value="0.9, 0.8, 0.7"/>'
    body = WALL.format(kind, authored + tags(3, "0.1, 0.2, 0.3", "0.5, 0.25, 0"))
    parameters = Loaded(read(tmp_path, body)).at(1, 0.5, 1)
    for name, expected in (
        ("specular_reflectance", (0.6, 0.325, 0.3)),
        ("specular_transmittance", (0.9, 0.8, 0.7)),
    ):
        (key,) = [k for k in parameters.keys() if k.endswith(f"{name}.value")]  # noqa: SIM118
        assert_allclose(np.array(parameters[key]).reshape(-1), expected, rtol=1e-6)


@pytest.mark.parametrize(
    ("kind", "name"), [("principled", "base_color"), ("roughconductor", "specular_reflectance")]
)
def test_whatever_is_a_bitmap_has_a_factor(tmp_path, kind, name) -> None:
    image = np.full((4, 4, 3), 0.5, dtype=np.float32)
    write_exr(tmp_path / "grey.exr", torch.from_numpy(image))
    file = '<string name="filename" value="grey.exr"/>'
    texture = f'<texture type="bitmap" name="{name}">{file}</texture>'
    parameters = Loaded(
        read(tmp_path, WALL.format(kind, texture + tags(3, "0, 0, 0", "1, 1, 1")))
    ).at(1, 0.5, 0)
    (key,) = [k for k in parameters.keys() if k.endswith(f"{name}.data")]  # noqa: SIM118
    found = np.array(parameters[key]).reshape(-1, 3)
    assert_allclose(found, np.broadcast_to([0.5, 0.25, 0], found.shape), atol=1e-6)


@pytest.mark.parametrize("kind", ["roughconductor", "roughdielectric", "roughplastic"])
@pytest.mark.parametrize("authored", ['<float name="alpha" value="0.01"/>', ""])
def test_roughness_of_a_bsdf_is_the_fourth_number(tmp_path, kind, authored) -> None:
    values = tags(1, "0, 0, 0, 0.01", "1, 1, 1, 0.5", kind="vector4f")
    loaded = Loaded(read(tmp_path, WALL.format(kind, authored + values)))
    assert loaded.description.component_names == ("var_paint.roughness",)
    for u, alpha in [(0, 0.01), (0.5, 0.26), (1, 0.51)]:
        parameters = loaded.at(u)
        (name,) = [k for k in parameters.keys() if ".alpha" in k]  # noqa: SIM118
        assert_allclose(np.array(parameters[name]).reshape(-1), alpha, rtol=1e-6)


def test_four_parameters_of_a_rough_bsdf(tmp_path) -> None:
    values = tags(4, "0, 0, 0, 0.5", "1, 1, 1, 0.5", kind="vector4f")
    description = read(tmp_path, WALL.format("roughconductor", values))
    assert description.component_names == (
        *(f"var_paint.albedo.{channel}" for channel in "rgb"),
        "var_paint.roughness",
    )
    colour, roughness = description.values([0, 0.5, 1, 0.5])
    assert_allclose(colour, (0, 0.5, 1))
    assert_allclose(roughness, 0.75)


def pictures(folder) -> str:
    """Two textures of one colour each, of different sizes, for the reflectance."""
    elements = []
    for name, size, colour in [("red", 4, (0.8, 0, 0)), ("green", 8, (0, 0.4, 0))]:
        image = np.ones((size, size, 3), dtype=np.float32) * np.array(colour, dtype=np.float32)
        write_exr(folder / f"{name}.exr", torch.from_numpy(image))
        file = f'<string name="filename" value="{name}.exr"/>'
        elements.append(f'<texture type="bitmap" name="reflectance">{file}</texture>')
    return "".join(elements)


def albedo(loaded, *v):
    """Of the ball at the origin, by Mitsuba's own albedo."""
    loaded.at(*v)
    hit = loaded.scene.ray_intersect(mi.Ray3f(mi.Point3f(0, 0, 9), mi.Vector3f(0, 0, -1)))
    return np.array(hit.bsdf().eval_diffuse_reflectance(hit)).reshape(3)


WRAPPED = """<bsdf type="twosided" id="outside"><bsdf type="diffuse" id="var_paint">{}</bsdf></bsdf>
<shape type="shapegroup" id="group"><shape type="sphere"><ref id="outside"/></shape></shape>
<shape type="instance"><ref id="group"/></shape>"""


@pytest.mark.parametrize("bsdf", [WALL.replace("{}", "diffuse", 1), WRAPPED])
def test_texture_of_a_bsdf(tmp_path, bsdf) -> None:
    loaded = Loaded(read(tmp_path, bsdf.format(pictures(tmp_path) + tags(1))))
    assert loaded.description.dimensions == 1
    assert_allclose(albedo(loaded, 0), (0.8, 0, 0), atol=1e-3)
    assert_allclose(albedo(loaded, 0.4), (0.8, 0, 0), atol=1e-3)
    assert_allclose(albedo(loaded, 0.6), (0, 0.4, 0), atol=1e-3)
    assert_allclose(albedo(loaded, 1), (0, 0.4, 0), atol=1e-3)


def test_colour_and_texture_of_a_bsdf(tmp_path) -> None:
    body = WALL.format("diffuse", pictures(tmp_path) + tags(4, "0.5, 0.5, 0.5", "0.5, 0.5, 0.5"))
    loaded = Loaded(read(tmp_path, body))
    assert loaded.description.dimensions == 4
    assert_allclose(albedo(loaded, 0, 0, 0, 0), (0.4, 0, 0), atol=1e-3)
    assert_allclose(albedo(loaded, 0, 1, 0, 1), (0, 0.4, 0), atol=1e-3)
    assert_allclose(albedo(loaded, 1, 0.5, 0, 1), (0, 0.3, 0), atol=1e-3)


def test_the_colour_is_a_factor_on_linear_light_where_the_texture_has_8_bits(tmp_path) -> None:
    image = np.full((4, 4, 3), 188, dtype=np.uint8)
    linear = ((188 / 255 + 0.055) / 1.055) ** 2.4
    mi.Bitmap(image).write(str(tmp_path / "grey.png"))
    texture = (
        '<texture type="bitmap" name="reflectance"><string name="filename" value="grey.png"/>'
        "</texture>"
    )
    body = WALL.format("diffuse", texture + tags(3, "0, 0, 0", "1, 1, 1"))
    loaded = Loaded(read(tmp_path, body))
    for colour in [(1, 0.5, 0), (1, 1, 1), (0.01, 0.123, 0.77)]:  # not rounded to 8 bits
        assert_allclose(albedo(loaded, *colour), linear * np.array(colour), atol=1e-6)


def test_grey_values_are_not_tinted(tmp_path) -> None:
    mi.Bitmap(np.full((4, 4), 188, dtype=np.uint8)).write(str(tmp_path / "grey.png"))
    texture = (
        '<texture type="bitmap" name="reflectance"><string name="filename" value="grey.png"/>'
        "</texture>"
    )
    description = read(tmp_path, WALL.format("diffuse", texture + tags(3)))
    said = r"scene\.xml: var_paint\.tint: 'var_paint': a bitmap of grey values .* three channels"
    with pytest.raises(ValueError, match=said):
        Loaded(description)


def test_a_texture_that_others_refer_to_keeps_its_colour_there(tmp_path) -> None:
    write_exr(tmp_path / "grey.exr", torch.full((4, 4, 3), 0.5))
    shared = '<texture type="bitmap" id="grey"><string name="filename" value="grey.exr"/></texture>'
    reference = '<ref id="grey" name="reflectance"/>'
    other = (
        '<shape type="sphere"><transform name="to_world"><translate x="5"/></transform>'
        f'<bsdf type="diffuse">{reference}</bsdf></shape>'
    )
    body = WALL.format("diffuse", reference + tags(3, "0, 0, 0", "1, 1, 1"))
    loaded = Loaded(read(tmp_path, shared + body + other))
    assert_allclose(albedo(loaded, 0.2, 0.4, 0.6), (0.1, 0.2, 0.3), atol=1e-6)
    hit = loaded.scene.ray_intersect(mi.Ray3f(mi.Point3f(5, 0, 9), mi.Vector3f(0, 0, -1)))
    assert_allclose(np.array(hit.bsdf().eval_diffuse_reflectance(hit)).reshape(3), 0.5, atol=1e-3)
