"""What is counted of a step and a frame, against sums by hand."""

import pytest
import torch

from ngi.models import PixelGenerator
from ngi.studies.benchmark.inference import products_per_pixel
from ngi.studies.benchmark.training import DIMENSIONS, OURS, PAPER
from ngi.studies.gpu_check.on_paper import (
    H100,
    counted,
    frame,
    milliseconds,
    paths_per_second,
    step,
)


def test_a_product_is_counted_with_its_operands() -> None:
    a, b = torch.zeros(4, 8, device="meta"), torch.zeros(8, 16, device="meta")
    found = counted(lambda: (a @ b).T[:2])
    assert found.operations == 2 * 4 * 8 * 16
    assert found.bytes == 4 * (4 * 8 + 8 * 16 + 4 * 16)
    assert found.launches == 1  # views are none


def test_a_frame_takes_the_products_of_its_pixels() -> None:
    network = PixelGenerator(
        layout=PAPER.layout, scene_dimensions=DIMENSIONS, hidden_features=512, hidden_layers=8
    )
    found = frame(PAPER, 512, 8, width=90, height=70)
    of_pixels = 2 * 90 * 70 * products_per_pixel(network)
    # Inputs are padded to a multiple of 8, and v is multiplied once.
    assert found.operations == pytest.approx(of_pixels, rel=0.05)
    assert found.operations > of_pixels


@pytest.mark.parametrize("learner", [PAPER, OURS])
def test_a_step_multiplies_three_times_as_often_as_an_image(learner) -> None:
    """Forward, by the weights backward, by the features backward; the first layer has no last."""
    pixels = learner.patches * 32 * 32
    image = frame(learner, 64, 4, width=pixels, height=1)
    ratio = step(learner, 64, 4).operations / image.operations
    assert 2.4 < ratio < 3.3


def test_what_bounds_it_follows_from_the_card() -> None:
    found = counted(lambda: torch.zeros(1000, 1000, device="meta") * 2)
    bounds = milliseconds(found, H100)
    assert bounds["memory"] == pytest.approx(1e3 * 12e6 / 3.35e12, rel=0.4)
    assert bounds["launches"] == pytest.approx(1e3 * found.launches * 5e-6)


def test_the_papers_paths_in_a_quarter_of_an_hour() -> None:
    few, many = paths_per_second()
    assert few == pytest.approx(37_000 * 1024 * 200 / 900)
    assert many == 120 * few
