"""Images of a recording, each a file of its own or inside a file of many images."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pipeline.io.depth_scale import known_in
from pipeline.io.images import NoDepthError, read_color, read_depth_values
from pipeline.types import ByteArray


@dataclass(frozen=True, slots=True)
class StoredImage:
    """An image inside a file of many images, which is read when it is requested."""

    file: Path
    name: str
    """Name or number of the image in its file."""
    read: Callable[[], NDArray[Any]] = field(compare=False, repr=False)
    """Returns (H, W, 3) RGB of a colour image, or (H, W) values of depth or confidence; raises an InputError
    if the image is damaged. It may be called from several threads."""

    def __str__(self) -> str:
        return f"{self.name} in {self.file}"


AnyImage: TypeAlias = Path | StoredImage


def is_file(path: Path, suffixes: tuple[str, ...]) -> bool:
    """Return whether a path is a file whose suffix, in lower case, is one of ``suffixes``."""
    return path.suffix.lower() in suffixes and path.is_file()


def exists(image: AnyImage) -> bool:
    """Return whether an image exists; a ``StoredImage`` always does."""
    return isinstance(image, StoredImage) or image.is_file()


def read_color_of(image: AnyImage) -> ByteArray:
    """Read (H, W, 3) RGB.

    Raises:
        InputError: as for ``images.read_color``, or the image is damaged in its file.
    """
    return image.read() if isinstance(image, StoredImage) else read_color(image)


def read_depth_of(image: AnyImage) -> NDArray[Any]:
    """Read (H, W) depth values, at least one of them known.

    Raises:
        InputError: as for ``images.read_depth_values``, or the image is damaged in its file.
    """
    if not isinstance(image, StoredImage):
        return read_depth_values(image)
    values = image.read()
    if not known_in(values).any():
        raise NoDepthError(f"The {image} has no depth anywhere; try another exposure of the scene")
    return values


def read_levels_of(image: AnyImage) -> NDArray[np.integer]:
    """Read (H, W) levels of confidence.

    Raises:
        InputError: as for ``read_color_of``.
    """
    return image.read() if isinstance(image, StoredImage) else read_color(image)[..., 0]
