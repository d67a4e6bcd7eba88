"""Splits that hold out whole scenes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from packetmesh.errors import InputError


def scene_of(name: str) -> str:
    """The part of ``scene/frame`` before the last slash; a name without one is a scene of its own."""
    return name.rpartition("/")[0] or name


def split_by_scene(names: Iterable[str], share: float, seed: int) -> tuple[list[str], list[str]]:
    """Names to learn from and names held out, no scene in both, each in the order given.

    Frames of one scene look alike, so a split by frame measures memory instead of skill.

    Args:
        names: ``scene/frame``.
        share: of the scenes to hold out, inside (0, 1); at least one scene is on each side.
        seed: which scenes; the order of the names does not matter.

    Raises:
        InputError: a share outside (0, 1), or fewer than two scenes.
    """
    if not 0.0 < share < 1.0:
        raise InputError(f"The share of scenes to hold out is {share}; try one between 0 and 1, such as 0.2")
    names = list(names)
    scenes = sorted({scene_of(name) for name in names})
    if len(scenes) < 2:
        found = f"only the scene {scenes[0]}" if scenes else "no scene"
        raise InputError(f"There is {found}, too little to split by scene; try a set with two scenes or more")
    count = min(max(round(share * len(scenes)), 1), len(scenes) - 1)
    order = np.random.default_rng(seed).permutation(len(scenes))
    held_out = {scenes[index] for index in order[:count]}
    kept = [name for name in names if scene_of(name) not in held_out]
    return kept, [name for name in names if scene_of(name) in held_out]
