"""Small files of the kinds that depth sets are made of."""

from pathlib import Path

import cv2
import numpy as np


def picture(width: int = 8, height: int = 6, seed: int = 0) -> np.ndarray:
    """(height, width, 3) RGB, another one for each seed."""
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)


def write_rgb(path: Path, rgb: np.ndarray) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), rgb[..., ::-1])
    return path


def write_units(path: Path, units: np.ndarray) -> Path:
    """A 16-bit depth image."""
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), units.astype(np.uint16))
    return path


def cut(path: Path, share: float = 0.6) -> None:
    """Keep only the first bytes of a file, as an interrupted copy does."""
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
