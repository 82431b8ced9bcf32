import pytest
import torch

from ngi.explore import (
    ConstantTarget,
    Loss,
    LossTimesOutputGradient,
    LossTimesStep,
    Signals,
)

SIGNALS = Signals(
    loss=torch.tensor([2.0, 0.0, 3.0]),
    output_gradient_norm=torch.tensor([5.0, 7.0, 0.5]),
    step_norm=torch.tensor([0.1, 0.2, 0.3]),
)


@pytest.mark.parametrize(
    ("target", "expected", "requires"),
    [
        (Loss(), [2.0, 0.0, 3.0], {"loss"}),
        (LossTimesStep(), [0.2, 0.0, 0.9], {"loss", "step_norm"}),
        (LossTimesOutputGradient(), [10.0, 0.0, 1.5], {"loss", "output_gradient_norm"}),
        (ConstantTarget(), [1.0, 1.0, 1.0], set()),
    ],
)
def test_targets_are_products_of_their_signals(target, expected, requires) -> None:
    torch.testing.assert_close(target(SIGNALS), torch.tensor(expected))
    assert target.requires == requires


@pytest.mark.parametrize(
    "target", [Loss(), LossTimesStep(), LossTimesOutputGradient(), ConstantTarget()]
)
def test_what_is_not_required_may_be_missing(target) -> None:
    optional = {"output_gradient_norm", "step_norm"} & target.requires
    signals = Signals(loss=SIGNALS.loss, **{name: getattr(SIGNALS, name) for name in optional})
    torch.testing.assert_close(target(signals), target(SIGNALS))


@pytest.mark.parametrize(
    ("target", "name"),
    [(LossTimesStep(), "step_norm"), (LossTimesOutputGradient(), "output_gradient_norm")],
)
def test_a_missing_signal_is_named(target, name) -> None:
    with pytest.raises(ValueError, match=f"'{name}'"):
        target(Signals(loss=SIGNALS.loss))


def test_a_nan_is_not_hidden() -> None:
    signals = Signals(loss=torch.tensor([float("nan"), 1.0]), step_norm=torch.ones(2))
    assert LossTimesStep()(signals).isnan().tolist() == [True, False]
