"""What every renderer is asked for: checked, and the window of pixels that a state means."""

from __future__ import annotations

from torch import Tensor

from ngi.render.tracing import Window


def require_positive(**numbers: int) -> None:
    """ValueError, naming it, for a number below 1."""
    for name, number in numbers.items():
        if number < 1:
            raise ValueError(f"renderer: {name} is {number}; expected a positive integer")


def check_states(states: Tensor, dimensions: int) -> None:
    """ValueError for states that are not [n, D + 2] numbers in [0, 1]."""
    if states.ndim != 2 or states.shape[1] != dimensions + 2:
        raise ValueError(
            f"states of shape {list(states.shape)}: expected [n, {dimensions + 2}], "
            f"{dimensions} scene variables and the patch position"
        )
    inside = (states >= 0) & (states <= 1)  # NaN is outside too
    if not bool(inside.all()):
        row, column = (~inside).nonzero()[0].tolist()
        raise ValueError(
            f"states[{row}, {column}] is {float(states[row, column])}; expected 0 to 1"
        )


def patch_window(position: Tensor, *, patch_size: int, resolution: int) -> Window:
    """The patch of P x P pixels at a position (x, y) in [0, 1]^2 of a square virtual image.

    Its first column is floor(x * (resolution - P + 1)), clamped to the last one; rows alike.
    Raises ValueError for a patch larger than the image.
    """
    if patch_size > resolution:
        raise ValueError(
            f"a patch of {patch_size} pixels is larger than the image of {resolution}; choose a "
            "resolution of at least patch_size"
        )
    last = resolution - patch_size
    x, y = (min(int(p * (last + 1)), last) for p in position.tolist())
    return Window(x, y, patch_size, patch_size, resolution)
