"""What each sample would do to the network, for the exploration target (paper, Sec. 5.1).

Nothing here calls `.backward()` or touches a parameter's `.grad`.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext

import torch
from torch import Tensor, nn

from ngi.models.loss import SampleLoss
from ngi.models.patch_linear import PatchLinear
from ngi.models.pixel_mlp import PixelMLP
from ngi.models.step_rules import StepRules


def output_gradient_norm(prediction: Tensor, target: Tensor, loss: SampleLoss) -> Tensor:
    """‖∂loss_i / ∂prediction_i‖, [n], by the loss alone: the network is not gone through.

    prediction: [n, P, P, 3] log1p radiance, an output of the network; its graph is left alone
    target: [n, P, P, 3] log1p radiance as rendered
    """
    with torch.enable_grad():
        output = prediction.detach().requires_grad_()
        (gradient,) = torch.autograd.grad(loss(output, target).sum(), output)
    norms: Tensor = torch.linalg.vector_norm(gradient.flatten(1), dim=1)
    return norms


def sample_step_norm(
    model: nn.Module,
    loss: SampleLoss,
    optimizer: torch.optim.Optimizer,
    inputs: tuple[Tensor, ...],
    target: Tensor,
) -> tuple[Tensor, Tensor]:
    """Loss of each sample, [n], and norm of the step that it alone would cause, [n].

    The norm is that of the total step of all parameters, momentum and RMS included, with the
    state that the optimiser holds (paper, Sec. 5.1); neither is changed. What it means for matrices
    that Muon steps is said at `ngi.models.muon_step.MuonStep`. The release goes through
    the network once per sample, and takes 1 for the norm before the first step, where this takes
    the true norm.

    model: a network all of whose parameters belong to `PatchLinear` layers or a `PixelMLP`, each
        called once
    optimizer: `torch.optim.Adam` or `MuonAdam` over all parameters of the model
    inputs: the network's arguments, such as buffers [n, P, P, C] and v [n, D]
    target: [n, P, P, 3] log1p radiance as rendered

    All samples share one forward pass and one backward pass for the gradients at the layers'
    outputs. When that pass reaches a layer, the layer's gradients per sample are formed, stepped,
    summed up and dropped. Autocast covers the matrix products; the rest is done in the
    parameters' precision.

    Raises TypeError for other models or optimisers, ValueError for options of Adam that are not
    supported and for an optimiser that does not hold all parameters.
    """
    with step_norms_in_backward(model, optimizer) as step_norms, torch.enable_grad():
        losses = loss(model(*inputs), target)
        total = losses.sum()
    with torch.autocast(target.device.type, enabled=False):
        torch.autograd.grad(total, list(model.parameters()))
    return losses.detach(), step_norms()


@contextmanager
def step_norms_in_backward(
    model: nn.Module,
    optimizer: torch.optim.Optimizer,
    *,
    gradient_scale: float = 1.0,
    around: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> Iterator[Callable[[], Tensor]]:
    """Has a training step's own backward pass measure what each of its samples would do.

    That pass then forms the gradients of each sample and sums them up to those of the batch, which
    are the same as without, up to rounding.
    The model is called once inside the block. Gives a function that returns the norms of
    `sample_step_norm`, [n], to be called when the backward pass is over and the optimiser has not
    stepped yet or has: what it was before is what counts.

    gradient_scale: by which the gradients of the samples alone are larger than those that come
        by; n where the loss is the mean over n samples
    around: what is entered while the norms are computed, to time them

    Raises as `sample_step_norm`, and RuntimeError in the backward pass where a part of the model
    was called twice.
    """
    parts = _watched_parts(model)
    rules = StepRules(optimizer)
    if not all(parameter in rules for parameter in model.parameters()):
        raise ValueError("the optimizer does not hold every parameter of the model")
    squared_norms: dict[Tensor, Tensor] = {}

    def add_squared_norms(parameter: Tensor, gradients: Tensor) -> None:
        with around(), torch.no_grad():
            if parameter in squared_norms:  # whose gradients would be sums over both calls
                raise RuntimeError("a part of the model is called twice in one pass")
            step = rules.step(parameter).scaled(gradient_scale)
            squared_norms[parameter] = step.squared_norm(gradients)

    for part in parts:
        part.watcher = add_squared_norms
    try:
        yield lambda: torch.stack([*squared_norms.values()]).sum(0).sqrt()
    finally:
        for part in parts:
            part.watcher = None


def _watched_parts(model: nn.Module) -> list[PatchLinear | PixelMLP]:
    parts = [module for module in model.modules() if isinstance(module, PatchLinear | PixelMLP)]
    covered = {parameter for part in parts for parameter in part.parameters()}
    for name, parameter in model.named_parameters():
        if parameter not in covered:
            raise TypeError(
                f"parameter '{name}' belongs to neither a PatchLinear layer nor a PixelMLP, so its "
                "gradient per sample is unknown: build the network from these, or choose a target "
                "that needs no step norm"
            )
    return parts
