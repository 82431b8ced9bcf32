"""SSIM, tone mapping, metrics and sizes at their limits."""

from __future__ import annotations

import math
from functools import partial

import torch

from ngi.evaluate import dssim, mae, mape, tone_map
from ngi.explore import ConstantTarget, Greedy, MarkovChains, NormalPerturbation
from ngi.models import L1Dssim, PixelGenerator
from ngi.patches import BufferLayout, Patches
from ngi.reuse import PatchStore
from ngi.studies.stability.case import Case, Conditions, Outcome

LOSS = L1Dssim(l1_weight=1.0, dssim_weight=1.0)
EPSILON = 0.01
"""Of MAPE, as in conf/evaluation."""

K1 = 0.01
"""Of SSIM, as everybody has it."""


def _constant_patches(_: Conditions, *, prediction: float, target: float) -> Outcome:
    """No variance: SSIM is its luminance term, and the gradient is to be finite."""
    output = torch.full((1, 16, 16, 3), prediction, requires_grad=True)
    loss = LOSS(output, torch.full((1, 16, 16, 3), target)).sum()
    loss.backward()
    x, y, c1 = prediction, target, K1**2
    ssim = (2 * x * y + c1) / (x * x + y * y + c1)
    assert output.grad is not None
    expected = abs(x - y) + (1 - ssim) / 2
    return Outcome(
        finite=bool(output.grad.isfinite().all()),
        error=abs(float(loss.detach()) - expected) / max(expected, 1),
        limit=1e-6,
        done="constants keep the ratio from 0 / 0",
    )


def _small_image(_: Conditions) -> Outcome:
    """Smaller than SSIM's window: the loss refuses it, and so does the metric."""
    said = []
    for what in (
        lambda: LOSS(torch.zeros(1, 8, 8, 3), torch.zeros(1, 8, 8, 3)),
        lambda: dssim(torch.zeros(6, 6, 3), torch.zeros(6, 6, 3)),
    ):
        try:
            what()
        except ValueError as error:
            said.append(str(error))
    return Outcome(finite=True, done=f"refused: {'; '.join(said)}", as_expected=len(said) == 2)


def _black(_: Conditions) -> Outcome:
    """A black image against itself, and against a prediction of 0.1."""
    black, grey = torch.zeros(32, 32, 3), torch.full((32, 32, 3), 0.1)
    same = [mape(black, black, EPSILON), mae(black, black), dssim(black, black)]
    relative = mape(grey, black, EPSILON)
    return Outcome(
        finite=all(map(math.isfinite, [*same, relative, dssim(grey, black)])),
        error=max(*same, abs(relative - 0.1 / EPSILON)),
        limit=1e-5,
        done="MAPE adds 0.01 to the reference",
    )


def _negative_prediction(_: Conditions) -> Outcome:
    """log1p radiance below 0 is negative radiance, which no picture can show."""
    log_radiance = torch.linspace(-40, 0, 32 * 32 * 3).reshape(32, 32, 3)
    radiance = torch.expm1(log_radiance)
    shown = tone_map(radiance)
    reference = torch.full_like(radiance, 0.5)
    values = [mape(radiance, reference, EPSILON), mae(radiance, reference)]
    return Outcome(
        finite=bool(shown.isfinite().all()) and all(map(math.isfinite, values)),
        error=float(radiance.min().abs() - 1),
        limit=1e-6,
        done="radiance stays above -1; shown as black",
        as_expected=bool((shown == 0).all()),
    )


def _huge_prediction(_: Conditions) -> Outcome:
    """Of log1p radiance 100, whose radiance float32 cannot hold."""
    radiance = torch.expm1(torch.full((32, 32, 3), 100.0))
    reference = torch.full_like(radiance, 0.5)
    value = mape(radiance, reference, EPSILON)
    return Outcome(
        finite=True,
        done="Inf: the metrics say so and the pixels are counted",
        as_expected=not math.isfinite(value),
    )


def _many_variables(_: Conditions, *, dimensions: int) -> Outcome:
    """Proposals, store and a step of the network: v is stored once per patch."""
    layout = BufferLayout()
    chains = MarkovChains(
        chains=16,
        proposal=NormalPerturbation(large_step_probability=0.3, standard_deviation=0.045),
        target=ConstantTarget(),
        acceptance=Greedy(accept_equal=True),
    )
    generator = torch.Generator().manual_seed(0)
    proposals = chains.propose(chains.init(dimensions + 2), generator, batch=0)
    patches = Patches.blank(16, layout=layout, dimensions=dimensions, patch_size=32)
    patches = Patches(**{**vars(patches), "scene_vector": proposals.position[:, :-2]})
    store = PatchStore(capacity=32, layout=layout)
    stored = store.get(store.add(patches))
    network = PixelGenerator(
        layout=layout, scene_dimensions=dimensions, hidden_features=64, hidden_layers=3
    )
    loss = LOSS(network(stored.buffers, stored.scene_vector), stored.log_radiance).mean()
    loss.backward()
    finite = all(bool(p.grad.isfinite().all()) for p in network.parameters() if p.grad is not None)
    return Outcome(
        finite=finite and bool(loss.isfinite()),
        error=float((stored.scene_vector - proposals.position[:, :-2]).abs().max()),
        limit=0.0,
        done=f"stored once per patch: {store.bytes_per_patch / 1024:.0f} KiB each",
    )


CASES = (
    Case("constant patches, equal", partial(_constant_patches, prediction=0.4, target=0.4), {}),
    Case("constant patches, both 0", partial(_constant_patches, prediction=0.0, target=0.0), {}),
    Case("constant patches, 0 and 18", partial(_constant_patches, prediction=0.0, target=18.0), {}),
    Case("constant patches, -1 and 1", partial(_constant_patches, prediction=-1.0, target=1.0), {}),
    Case("image smaller than SSIM's window", _small_image, {}),
    Case("black reference", _black, {}),
    Case("negative predictions", _negative_prediction, {}),
    Case("predictions that overflow", _huge_prediction, {}),
    Case("5,000 variables", partial(_many_variables, dimensions=5000), {}),
)
