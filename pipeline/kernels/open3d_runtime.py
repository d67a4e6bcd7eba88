"""Import of Open3D on a bare Linux: its shared library needs libusb, which a pip package provides.

Open3D's notebook plots, unused here, import dash, which would delay the start of every process
(``python -X importtime -m pipeline.kernels.open3d_runtime``); an empty module replaces dash during the
import. Its viewer for notebooks, unused too, is disabled: it would print three lines into the first cell.
"""

import ctypes
import os
import sys
from types import ModuleType

if sys.platform == "linux":
    import libusb_package

    _libusb = libusb_package.get_library_path()
    if _libusb is not None:
        ctypes.CDLL(str(_libusb), mode=ctypes.RTLD_GLOBAL)

_dash = ModuleType("dash")
_dash.html = _dash.dcc = _dash.Dash = None  # type: ignore[attr-defined]
_stands_in = sys.modules.setdefault("dash", _dash) is _dash

os.environ.setdefault("OPEN3D_DISABLE_WEB_VISUALIZER", "true")

import open3d as o3d  # noqa: E402

if _stands_in:
    del sys.modules["dash"]

o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)

__all__ = ["o3d"]
