"""Which sampler a scene is told to use: what moves or bars light, makes caustics, is dear."""

import pytest

from ngi.files.resources import root
from ngi.machine.backend import activate
from ngi.render.materials import collect_materials
from ngi.render.pilot_advice import PAGE, pilot_advice
from ngi.render.sampling_advice import sampling_advice
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene

ROOM = """<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective" id="camera"><film type="hdrfilm"/></sensor>
<bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.5"/></bsdf>
<shape type="sphere" id="ball">BALL</shape>
<emitter type="point" id="bulb"/>
<shape type="rectangle" id="lamp"><emitter type="area"/><ref id="paint"/></shape>
</scene>"""

DIFFUSE = "<ref id='paint'/>"
GLASS = "<bsdf type='dielectric' id='glass'/>"
METAL = "<bsdf type='roughconductor' id='metal'><float name='alpha' value='0.4'/></bsdf>"

PAINT = "{object: paint, property: albedo, minimum: [0,0,0], maximum: [1,1,1]}"
MOVE_BALL = "{object: ball, property: translation, minimum: [0,0,0], maximum: [0,1,2]}"
MOVE_LAMP = "{object: lamp, property: translation, minimum: [0,0,0], maximum: [0,1,2]}"
MOVE_BULB = "{object: bulb, property: translation, minimum: [0,0,0], maximum: [0,1,2]}"
DIM_BULB = "{object: bulb, property: intensity, minimum: 0.5, maximum: 2}"
SWITCH_BULB = "{object: bulb, property: intensity, minimum: 0, maximum: 2}"
POLISH = "{object: metal, property: roughness, minimum: LOW, maximum: 0.5}"


@pytest.fixture
def advice(tmp_path):
    def give(*variables: str, ball: str = DIFFUSE, samples: int = 32) -> str:
        activate("scalar")
        (tmp_path / "scene.xml").write_text(ROOM.replace("BALL", ball))
        (tmp_path / "scene.yaml").write_text(
            f"{{name: room, scene: scene.xml, samples_per_pixel: {samples}, max_depth: 3,\n"
            "bounds: {minimum: [-4, -4, -4], maximum: [4, 4, 4]}, "
            f"variables: [{', '.join(variables)}]}}"
        )
        scene = VariableScene(read_scene(tmp_path))
        return "\n".join(sampling_advice(scene, collect_materials(scene.bsdfs())))

    return give


@pytest.mark.parametrize("variables", [[PAINT], [DIM_BULB], [PAINT, DIM_BULB]])
def test_where_nothing_moves_nothing_is_rare(advice, variables) -> None:
    text = advice(*variables, ball=GLASS)
    assert text.startswith("sampler=sobol: ")
    assert "ours_eager" not in text
    assert "samples_per_pixel" not in text
    assert text.count("docs/guide/sampler.md") == 1


@pytest.mark.parametrize(
    ("variable", "light"), [(MOVE_LAMP, "lamp"), (MOVE_BULB, "bulb"), (SWITCH_BULB, "bulb")]
)
def test_what_a_light_does_that_moves_or_goes_out_can_be_rare(advice, variable, light) -> None:
    text = advice(PAINT, variable)
    assert "method=ours_eager, if 20% or more" in text
    assert f"{light} moves or goes out" in text
    assert "caustics" not in text


def test_what_moves_may_let_light_pass_at_few_of_its_positions(advice) -> None:
    text = advice(PAINT, MOVE_BALL, ball=GLASS)
    assert "method=ours_eager, if 20% or more" in text
    assert "ball may bar the light's way" in text
    assert "moves or goes out" not in text
    assert "caustics" not in text


@pytest.mark.parametrize(
    ("ball", "variables", "caustics"),
    [
        (GLASS, [], True),
        (METAL, [], False),
        (METAL, [POLISH.replace("LOW", "0.05")], True),
        (METAL, [POLISH.replace("LOW", "0.2")], False),
    ],
)
def test_smooth_surfaces_make_caustics_of_it(advice, ball, variables, caustics) -> None:
    text = advice(MOVE_LAMP, *variables, ball=ball)
    assert ("smooth surfaces make caustics" in text) == caustics


@pytest.mark.parametrize(("samples", "dear"), [(64, False), (199, False), (200, True)])
def test_patches_that_take_long_had_better_be_small(advice, samples: int, dear: bool) -> None:
    line = f"method=ours_small_patches with the scene's {samples} samples per pixel"
    assert (line in advice(PAINT, samples=samples)) == dear


def test_where_patches_are_dear_more_of_them_come_first(advice) -> None:
    assert "of budget=machine or budget=hour instead of 24000" in advice(PAINT, samples=24000)


def test_a_pilot_run_says_how_concentrated_its_loss_is_and_what_follows() -> None:
    text = pilot_advice(0.083)
    assert "had 8% of the loss" in text
    assert "exploring pays from 20% on" in text
    assert (root() / PAGE).is_file()
