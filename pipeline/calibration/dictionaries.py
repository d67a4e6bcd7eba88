"""Dictionaries of square markers that OpenCV knows, by the names that users and files give them."""

from __future__ import annotations

from typing import Any

import cv2

from packetmesh.errors import InputError

FAMILIES = (
    *("5X5_1000", "4X4_1000", "6X6_1000", "7X7_1000", "ARUCO_ORIGINAL", "ARUCO_MIP_36H12"),
    *("APRILTAG_36H11", "APRILTAG_36H10", "APRILTAG_25H9", "APRILTAG_16H5"),
)
"""Dictionaries that together have all of OpenCV's markers: the smaller dictionaries of 4 x 4 to 7 x 7 cells
are the first markers of the largest. The first entry is the dictionary of our own ChArUco boards."""
APRILGRID = "APRILTAG_36H11"
"""Dictionary of Kalibr's AprilGrid."""
_PREFIX = "DICT_"


def known_dictionary(name: str) -> str:
    """Return OpenCV's name without its prefix, such as 4X4_50, for a name in any case, with or without it.

    Raises:
        InputError: OpenCV has no dictionary of this name.
    """
    plain = name.strip().upper().removeprefix(_PREFIX)
    if not hasattr(cv2.aruco, _PREFIX + plain):
        raise InputError(
            f"There is no dictionary '{name}'; try one of OpenCV's, such as 4X4_50, 5X5_1000, 6X6_250, "
            "ARUCO_ORIGINAL or APRILTAG_36H11"
        )
    return plain


def dictionary(name: str) -> Any:
    """Return OpenCV's dictionary of a name that ``known_dictionary`` returns."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, _PREFIX + name))


def markers_in(name: str) -> int:
    """Return the number of markers of a dictionary."""
    return len(dictionary(name).bytesList)
