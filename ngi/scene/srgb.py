"""The transfer curve of sRGB (IEC 61966-2-1), between linear numbers and those of a screen."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Values = NDArray[np.float64]


def encoded(linear: ArrayLike) -> Values:
    """Linear numbers in [0, 1] as sRGB has them, in [0, 1] too."""
    numbers = np.asarray(linear, dtype=np.float64)
    curve = 1.055 * np.maximum(numbers, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(numbers <= 0.0031308, 12.92 * numbers, curve)


def decoded(encoded: ArrayLike) -> Values:
    """The inverse."""
    numbers = np.asarray(encoded, dtype=np.float64)
    curve = ((np.maximum(numbers, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(numbers <= 0.04045, numbers / 12.92, curve)
