"""Rigid transforms as the quaternions and positions of viser's scene nodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.types import FloatArray


def wxyz_of(T: FloatArray) -> FloatArray:
    """Return the unit quaternion, w first, of a (4, 4) rigid transform."""
    from viser import transforms  # here, so that computing processes, which never draw, do not load it

    return transforms.SO3.from_matrix(np.asarray(T[:3, :3], dtype=np.float64)).wxyz


def move(handle: Any, T_parent_node: FloatArray) -> None:
    """Change a scene node's pose to a (4, 4) pose in its parent, without sending the node again."""
    handle.wxyz = wxyz_of(T_parent_node)
    handle.position = np.asarray(T_parent_node[:3, 3])


def place(handle: Any, T_parent_node: FloatArray) -> None:
    """Set a new scene node's (4, 4) pose, even if the browser remembers a removed node of the same name.

    A new handle assumes the pose of its parent's origin and sends nothing if that is its pose, while the
    browser keeps the pose of the removed node. So the pose is first changed to another one.
    """
    handle.wxyz = (0.0, 1.0, 0.0, 0.0)
    handle.position = np.asarray(T_parent_node[:3, 3]) + 1.0
    move(handle, T_parent_node)
