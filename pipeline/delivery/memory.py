"""Cache for the moments of a delivery: a stage runs again only when images that it uses have changed."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Generator, Hashable, Sequence
from typing import TypeVar

from packetmesh.progress import Progress
from pipeline.config import PipelineConfig
from pipeline.types import RgbdFrame, Rig

Result = TypeVar("Result")
COLOR_ONLY, DEPTH_ONLY = ("inferred",), ("outliers",)
"""Stages that use only colour, or only depth."""


def places_by_depth(config: PipelineConfig, rig: Rig) -> bool:
    """Return whether the nodes' poses depend on depth alone: sensor clouds are registered by distances only,
    from given poses. The search for unknown poses uses colours, and ``hicp`` weighs them.
    """
    registration = config.node_registration
    return (
        config.fusion.align_nodes_with == "sensor"
        and registration.start == "given"
        and registration.method != "hicp"
        and all(frame.pose_known for frame in rig.frames)
    )


class Memory:
    """Cache with the newest result of each stage of one delivery, whose settings never change."""

    def __init__(self, placed_by_depth: bool) -> None:
        """Create an empty cache; ``placed_by_depth`` is True if colours do not change the nodes' poses."""
        self._depth_only = (*DEPTH_ONLY, "placement") if placed_by_depth else DEPTH_ONLY
        self._color: Hashable = None
        self._depth: Hashable = None
        self._kept: dict[Hashable, tuple[Hashable, object]] = {}

    def look_at(self, frames: Sequence[RgbdFrame]) -> bool:
        """Set the frames of the next moment; returns whether any image has changed."""
        before = self._color, self._depth
        self._color = tuple((frame.name, _digest(frame.rgb), _digest(frame.rgb_known)) for frame in frames)
        self._depth = tuple(
            (frame.name, _digest(frame.depth.z_m), _digest(frame.coarse and frame.coarse.z_m))
            for frame in frames
        )
        return before != (self._color, self._depth)

    def remember(
        self, key: tuple[Hashable, ...], compute: Callable[[], Generator[Progress, None, Result]]
    ) -> Generator[Progress, None, Result]:
        """Return the kept result of stage ``key[0]`` if its images are the same, else compute and keep it."""
        stage, images = key[0], self._images(key[0])
        kept = self._kept.get(stage)
        if kept is not None and kept[0] == images:
            return kept[1]  # type: ignore[return-value]
        result = yield from compute()
        self._kept[stage] = images, result
        return result

    def _images(self, stage: Hashable) -> Hashable:
        if stage in COLOR_ONLY:
            return self._color
        if stage in self._depth_only:
            return self._depth
        return self._color, self._depth


def _digest(array: object) -> bytes | None:
    return None if array is None else hashlib.blake2b(array.tobytes(), digest_size=16).digest()  # type: ignore[attr-defined]
