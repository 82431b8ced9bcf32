"""Many variables at once with LLVM: the same scenes, and kernels that are never compiled again."""

import numpy as np
import pytest
import torch

from ngi.machine.backend import activate, llvm_problem, mi
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene
from ngi.scene.jit_variables import address, aligned
from ngi.studies.benchmark.measure import counted_kernels
from tests.scene import (
    test_updates_of_appearance,
    test_updates_of_light_and_view,
    test_updates_of_objects,
)
from tests.scene.updates import check_update, scene_of, together

pytestmark = pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))

UPDATES = [
    together(
        "objects that move and deform",
        test_updates_of_objects.UPDATES,
        "key frames of a mesh with vertex normals that moves too",
        "translation of an instance",
        "translation of a sphere",
        "translation of a rectangle",
        "rotation of an emitting rectangle about its own origin",
        "scale of an emitting mesh",
        "scale of an instance",
    ),
    together(
        "objects that vanish and turn",
        test_updates_of_objects.UPDATES,
        "key frames of a mesh without vertex normals",
        "translation * rotation * scale",
        "shape",
        "rotation of an emitting mesh about its own origin",
        "translation of an emitting rectangle",
    ),
    together(
        "materials and their parameters",
        test_updates_of_appearance.UPDATES,
        "material of a sphere, a rectangle, an instance and a group",
        "albedo of several kinds of BSDF",
    ),
    together(
        "materials and texels",
        test_updates_of_appearance.UPDATES,
        "texels in 8 bits",
        "material of an instance that moves",
    ),
    together(
        "textures and roughness",
        test_updates_of_appearance.UPDATES,
        "texture in floating point",
        "roughness of metal",
    ),
    together(
        "variables of a choice",
        test_updates_of_appearance.UPDATES,
        "variables of a BSDF that is only a choice",
        "roughness of principled",
    ),
    together(
        "lamps and camera",
        test_updates_of_light_and_view.UPDATES,
        "intensity and radiance of one emitter, by its own id and its shape's",
        "look_at",
    ),
    together(
        "lights that move, and the field of view",
        test_updates_of_light_and_view.UPDATES,
        "translation of a point light",
        "place, direction and cone of a spot",
        "fov",
    ),
    together(
        "sun, sky and camera path",
        test_updates_of_light_and_view.UPDATES,
        "direction of the sun [0.25, 0.5]",
        "intensity of sun and sky",
        "rotation of the sky",
        "camera_path",
    ),
]


@pytest.mark.parametrize("update", UPDATES, ids=lambda update: update.name)
def test_update_equals_a_scene_written_with_the_values(update, make_scene) -> None:
    check_update(update, "llvm", make_scene)


@pytest.mark.parametrize("update", UPDATES, ids=lambda update: update.name)
def test_nothing_is_compiled_and_nothing_is_stale(update, make_scene) -> None:
    scene = read_scene(scene_of(update, make_scene))

    def renderer():
        return MitsubaRenderer(scene=scene, backend="llvm", patch_size=16, samples_per_pixel=4)

    warm = renderer()
    warm.warm_up()
    generator = torch.Generator().manual_seed(0)
    states = torch.rand(8, scene.dimensions + 2, generator=generator)
    states[0, :-2], states[1, :-2] = torch.tensor(update.v), torch.tensor(update.off)
    with counted_kernels() as kernels:
        patches = warm.render_patches(states, resolution=24, seed=1)
    assert kernels.compiled == 0
    del warm
    for i in (1, 7):
        anew = renderer().render_patches(states[i : i + 1], resolution=24, seed=1)
        assert torch.equal(anew.log_radiance[0], patches.log_radiance[i])
        assert torch.equal(anew.buffers[0], patches.buffers[i])
        assert not torch.equal(anew.log_radiance[0], patches.log_radiance[i - 1])


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_what_is_uploaded_lies_where_dr_jit_s_own_memory_would(kind) -> None:
    activate("llvm")
    numbers = np.random.default_rng(0).integers(0, 255, (5, 7, 3)).astype(np.float64)
    kept = [aligned(numbers, kind) for _ in range(20)]
    for array in kept:
        assert array.ctypes.data % 64 == 0
        assert array.dtype == kind
        assert np.array_equal(array, numbers)
        tensor = (mi.TensorXu8 if kind == np.uint8 else mi.TensorXf)(array)
        assert address(tensor.array) % 64 == 0
