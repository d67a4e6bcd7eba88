"""Closest-point pairs between a moving source and a fixed target (eq. 3.10)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from pipeline.config import Direction
from pipeline.geometry import apply
from pipeline.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Matching:
    """Pairs of points at one pose; rows of all arrays belong together."""

    source_rows: IntArray
    """(M,) rows of the source points."""
    target_rows: IntArray
    """(M,) rows of the target points."""
    moved_m: FloatArray
    """(M, 3) source points at this pose, in the target frame."""
    target_m: FloatArray
    """(M, 3)."""
    distances_m: FloatArray
    """(M,)."""

    def select(self, rows: IntArray) -> Matching:
        """The pairs at ``rows``."""
        return Matching(
            self.source_rows[rows],
            self.target_rows[rows],
            self.moved_m[rows],
            self.target_m[rows],
            self.distances_m[rows],
        )


class Matcher:
    """Finds pairs at any pose; both search trees are built once, in the frames of their own clouds."""

    def __init__(self, source_m: FloatArray, target_m: FloatArray, direction: Direction) -> None:
        self._source_m, self._target_m, self._direction = source_m, target_m, direction
        self._source_tree = cKDTree(source_m) if direction != "q2p" else None
        self._target_tree = cKDTree(target_m) if direction != "p2q" else None

    def match(self, T_target_source: FloatArray) -> Matching:
        """Closest pairs in the matcher's direction at a (4, 4) rigid or similarity pose."""
        moved_m = apply(T_target_source, self._source_m)
        found = []
        if self._target_tree is not None:
            nearest = self._target_tree.query(moved_m, workers=-1)[1]
            found.append(np.stack([np.arange(len(moved_m)), nearest], axis=1))
        if self._source_tree is not None:
            back_m = apply(np.linalg.inv(T_target_source), self._target_m)
            nearest = self._source_tree.query(back_m, workers=-1)[1]
            found.append(np.stack([nearest, np.arange(len(back_m))], axis=1))
        pairs = found[0] if len(found) == 1 else np.unique(np.concatenate(found), axis=0)
        source_rows, target_rows = pairs.T
        moved_m, target_m = moved_m[source_rows], self._target_m[target_rows]
        distances_m = np.linalg.norm(moved_m - target_m, axis=1)
        return Matching(source_rows, target_rows, moved_m, target_m, distances_m)
