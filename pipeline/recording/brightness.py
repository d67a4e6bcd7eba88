"""Photographs of a recording's frames, by which motions are found that depth leaves open (SPEC 10.1)."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.geometry import scaled
from pipeline.recording.recording import Recording
from pipeline.registration.photometric import Photograph, held_by_color, photograph
from pipeline.types import FloatArray, RgbdFrame

WIDTH_PX = 320
"""Approximate width of the photographs that are compared."""


class Brightness:
    """Reads frames in colour, and keeps the last keyframe's."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._keyframe: tuple[int, Photograph | None] = (-1, None)

    def corrected(
        self, source: int, keyframe: int, T_keyframe_source: FloatArray, motions: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """Correct a frame's pose by colour (``held_by_color``); None also if an image cannot be read."""
        if self._keyframe[0] != keyframe:
            self._keyframe = keyframe, self._read(keyframe)
        target, own = self._keyframe[1], self._read(source)
        if own is None or target is None:
            return None
        return held_by_color(own, target, T_keyframe_source, motions)

    @cached_property
    def _T_color_depth(self) -> FloatArray:
        return self._recording.view(0).T_color_depth

    def _read(self, number: int) -> Photograph | None:
        try:
            return photograph(shrunk(self._recording.frame(number)), self._T_color_depth)
        except InputError:
            return None


def shrunk(frame: RgbdFrame) -> RgbdFrame:
    """Return a frame about ``WIDTH_PX`` wide: colours averaged, depth of every n-th row and column.

    A frame that is already so narrow, or whose images differ in size, is returned unchanged.
    """
    step = max(1, round(frame.intrinsics.width_px / WIDTH_PX))
    if step == 1 or frame.depth.z_m.shape != frame.rgb.shape[:2]:
        return frame
    height_px, width_px = (size // step for size in frame.rgb.shape[:2])
    rgb = np.ascontiguousarray(frame.rgb[: height_px * step, : width_px * step])
    small = cv2.resize(rgb, (width_px, height_px), interpolation=cv2.INTER_AREA)
    middle = slice(step // 2, None, step)
    z_m = np.ascontiguousarray(frame.depth.z_m[middle, middle][:height_px, :width_px])
    camera = replace(scaled(frame.intrinsics, 1.0 / step), width_px=width_px, height_px=height_px)
    depth = replace(frame.depth, z_m=z_m)
    return replace(frame, rgb=np.asarray(small, np.uint8), depth=depth, intrinsics=camera)
