"""A texture of 5,000 variables: what must not grow with them, and what must stay fast."""

import time
import tracemalloc

import numpy as np
import pytest
import torch
from PIL import Image

from ngi.patches import BufferLayout, Patches
from ngi.reuse import PatchStore
from ngi.scene import read_scene
from tests.scene.stage import set_value

ROWS, COLUMNS = 50, 100
D = ROWS * COLUMNS


@pytest.fixture
def folder(make_scene):
    entry = {"object": "picture", "property": "texels", "size": [ROWS, COLUMNS]}
    folder = make_scene(
        "stage",
        [{**entry, "minimum": 0.2, "maximum": 0.6}],
        dimensions=D,
        edit=lambda root: set_value(root, "picture", "filename", "large.png"),
    )
    Image.new("RGB", (COLUMNS, ROWS)).save(folder / "large.png")
    return folder


def seconds(function, repeats=5):
    """The shortest of some runs, which other work on the machine disturbs least."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def test_names_and_values(folder) -> None:
    scene = read_scene(folder)
    assert scene.dimensions == len(scene.component_names) == len(set(scene.component_names)) == D
    assert scene.component_names[0] == "picture.texels.0_0"
    assert scene.component_names[COLUMNS + 2] == "picture.texels.1_2"
    assert scene.component_names[-1] == f"picture.texels.{ROWS - 1}_{COLUMNS - 1}"
    v = np.random.default_rng(0).random(D)
    (value,) = scene.values(v)
    assert value.shape == (ROWS, COLUMNS)
    np.testing.assert_allclose(value.ravel(), 0.2 + 0.4 * v)


def test_values_are_fast_and_so_is_the_number_of_components(folder) -> None:
    scene = read_scene(folder)
    v = np.random.default_rng(0).random(D)
    assert seconds(lambda: scene.values(v)) < 2e-3
    assert seconds(lambda: scene.dimensions) < 1e-4


def test_message_for_a_wrong_vector_stays_short(folder) -> None:
    with pytest.raises(ValueError, match=r"has 5000 variables, .*, \.\.\.") as error:
        read_scene(folder).values(np.zeros(3))
    assert len(str(error.value)) < 1000


def patches(dimensions, count=8):
    layout = BufferLayout(("position", "albedo"))
    return layout, Patches.blank(count, layout=layout, dimensions=dimensions, patch_size=32)


def test_a_stored_patch_grows_by_its_vector_only() -> None:
    sizes = {}
    for dimensions in (1, D):
        layout, some = patches(dimensions)
        store = PatchStore(capacity=16, layout=layout)
        ids = store.add(some)
        assert torch.equal(store.get(ids).scene_vector, some.scene_vector)
        sizes[dimensions] = store.bytes_per_patch
    assert sizes[D] - sizes[1] == (D - 1) * 4


def test_memory_of_patches_grows_by_their_vectors_only() -> None:
    sizes = {}
    for dimensions in (1, D):
        _, some = patches(dimensions)
        tensors = (getattr(some, name) for name in some.__dataclass_fields__)
        sizes[dimensions] = sum(t.untyped_storage().nbytes() for t in tensors)
    assert sizes[D] - sizes[1] == 8 * (D - 1) * 4


def test_values_keep_no_memory(folder) -> None:
    scene = read_scene(folder)
    v = np.random.default_rng(0).random(D)
    scene.values(v)
    tracemalloc.start()
    for _ in range(50):
        scene.values(v)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 100_000
