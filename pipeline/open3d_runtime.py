"""Open3D, importable on a bare Linux: its shared library wants libusb, which pip brings."""

import ctypes
import sys

if sys.platform == "linux":
    import libusb_package

    _libusb = libusb_package.get_library_path()
    if _libusb is not None:
        ctypes.CDLL(str(_libusb), mode=ctypes.RTLD_GLOBAL)

import open3d as o3d

o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)

__all__ = ["o3d"]
