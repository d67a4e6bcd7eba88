"""sRGB of 8 bits as linear light, in which glTF stores vertex colours, and back (IEC 61966-2-1)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.types import ByteArray, FloatArray


def linear_of(colors: ByteArray) -> FloatArray:
    """Return the linear light, 0 to 1, of sRGB values of any shape."""
    srgb = colors / 255.0
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def srgb_of(linear: NDArray[Any]) -> ByteArray:
    """Return the sRGB values of linear light: floating-point from 0 to 1, or whole numbers of any width."""
    largest = np.iinfo(linear.dtype).max if linear.dtype.kind in "iu" else 1.0
    light = np.clip(np.nan_to_num(linear) / largest, 0.0, 1.0)
    srgb = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055)
    return np.rint(255.0 * srgb).astype(np.uint8)
