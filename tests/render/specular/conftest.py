import pytest

from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene
from tests.render.optics import write_scene
from tests.render.specular.scenes import COLOURS, PAINT


@pytest.fixture
def load(tmp_path):
    def load(shapes, *, backend, variables=(PAINT,), max_depth=10, fov=20, **arguments):
        write_scene(
            tmp_path,
            shapes=shapes,
            variables=variables,
            max_depth=max_depth,
            fov=fov,
            image=COLOURS,
        )
        arguments = {"specular": "traced", "buffer_samples": 1, "patch_size": 8} | arguments
        return MitsubaRenderer(scene=read_scene(tmp_path), backend=backend, **arguments)

    return load
