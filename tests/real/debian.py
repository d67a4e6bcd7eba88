"""Where Debian's packages with images of boards put them."""

import os
from pathlib import Path

import pytest


def opencv_doc() -> Path:
    """The data of ``opencv-doc``'s examples; without them the test is skipped."""
    return _installed("PACKETMESH_OPENCV_DOC", "/usr/share/doc/opencv-doc/examples/data")


def visp_images() -> Path:
    """The images of ``visp-images-data``; without them the test is skipped."""
    return _installed("PACKETMESH_VISP_IMAGES", "/usr/share/visp-images-data/ViSP-images")


def _installed(variable: str, usual: str) -> Path:
    path = Path(os.environ.get(variable, usual))
    if not path.is_dir():
        pytest.skip(f"no images at {path}; install the Debian package or set {variable}")
    return path
