"""What a view looks like on a screen: side by side, through a curve, buffers as colours."""

import numpy as np
import pytest
import torch

from ngi.evaluate.pictures import eight_bit, error_picture, srgb_picture
from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer
from ngi.render.analytic import AMBIENT, LAMP_RADIANCE
from ngi.view.scene_view import Place, SceneView
from ngi.view.screen import CURVES, PARTS, Screen, shown

V = (0.2, 0.5, 0.8)


@pytest.fixture
def view() -> SceneView:
    layout = BufferLayout().adding(["throughput", "direct"])
    renderer = AnalyticRenderer(dimensions=3, patch_size=16, layout=layout)
    return SceneView(Place(V, 32), renderer, lambda buffers, *_, **__: buffers[..., :3])


def test_side_by_side_with_the_reference_and_the_error(view: SceneView) -> None:
    v = torch.tensor(V)
    reference = view.renderer.render_image(v, resolution=32, samples_per_pixel=1, seed=0)
    pixels = Screen("network | path tracer | error", epsilon=0.01).pixels(view)
    assert pixels.shape == (32, 96, 3)
    np.testing.assert_array_equal(pixels[:, 32:64], srgb_picture(reference, 0.0))
    np.testing.assert_array_equal(
        pixels[:, 64:], error_picture(view.prediction, reference.float(), 0.01)
    )


def test_every_buffer_and_part_can_be_shown(view: SceneView) -> None:
    for name in (*PARTS, *view.renderer.layout.names):
        pixels = Screen(name).pixels(view)
        assert pixels.dtype == np.uint8
        assert pixels.shape == (32, 32 * len(Screen(name).parts), 3)


@pytest.mark.parametrize(("name", "curve"), [("direct", "filmic"), ("emission", "linear")])
def test_light_in_the_buffers_is_shown_as_pictures_are(
    view: SceneView, name: str, curve: str
) -> None:
    layout = view.renderer.layout
    lamp = LAMP_RADIANCE * (view.buffers[..., layout.slice("emission")] > 0)
    ambient = AMBIENT * view.buffers[..., layout.slice("albedo")]
    light = {"emission": lamp, "direct": view.reference - lamp - ambient}[name]
    expected = eight_bit(shown(light, curve=curve, exposure=-2.0))
    assert 0 < expected.max() < 255
    pixels = Screen(name, curve=curve, exposure=-2.0).pixels(view)
    np.testing.assert_allclose(pixels.astype(int), expected, atol=1)


def test_exposure_leaves_buffers_alone_that_are_no_light(view: SceneView) -> None:
    for name in ("position", "albedo", "throughput"):
        pixels = Screen(name, curve="linear", exposure=-2.0).pixels(view)
        np.testing.assert_array_equal(pixels, Screen(name).pixels(view))


def test_tone_curves() -> None:
    radiance = torch.tensor([[[0.0, 0.18, 1.0], [4.0, -1.0, torch.nan]]])
    linear = shown(radiance, curve="linear", exposure=1.0)
    assert linear[0, 0].tolist() == pytest.approx([0, 0.36, 1])
    assert linear[0, 1, :2].tolist() == [1, 0]
    for curve in CURVES:
        values = shown(radiance, curve=curve, exposure=0.0)
        assert values[0, 1, 2].isnan()
        finite = values[~values.isnan()]
        assert ((finite >= 0) & (finite <= 1)).all()
    # Narkowicz 2015: x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14), then the sRGB curve
    x = 0.18
    expected = (
        1.055 * ((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)) ** (1 / 2.4) - 0.055
    )
    filmic = shown(radiance, curve="filmic", exposure=0.0)
    assert filmic[0, 0, 1].item() == pytest.approx(expected, rel=1e-5)
    with pytest.raises(ValueError, match="curve 'pink'"):
        shown(radiance, curve="pink", exposure=0.0)
