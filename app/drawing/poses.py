"""Rigid transforms to what viser wants."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.types import FloatArray


def wxyz_of(T: FloatArray) -> FloatArray:
    """Unit quaternion, w first, of a (4, 4) rigid transform."""
    from viser import transforms  # here, as computing processes, which never draw, need not wait for it

    return transforms.SO3.from_matrix(np.asarray(T[:3, :3], dtype=np.float64)).wxyz


def move(handle: Any, T_parent_node: FloatArray) -> None:
    """Give a scene node another pose without sending it again."""
    handle.wxyz = wxyz_of(T_parent_node)
    handle.position = np.asarray(T_parent_node[:3, 3])


def place(handle: Any, T_parent_node: FloatArray) -> None:
    """Give a new scene node its pose, also where the browser remembers a removed node of the same name.

    A fresh handle believes it stands at its parent's origin and sends nothing if that is where it is put,
    while the browser keeps the pose of the node it knew; so the pose is changed first.
    """
    handle.wxyz = (0.0, 1.0, 0.0, 0.0)
    handle.position = np.asarray(T_parent_node[:3, 3]) + 1.0
    move(handle, T_parent_node)
