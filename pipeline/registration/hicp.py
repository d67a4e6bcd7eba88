"""Hue-assisted ICP: nearest neighbours in position and hue (SPEC 4.6)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.config import RegistrationConfig
from pipeline.registration.icp import TrimmedIcp
from pipeline.types import ByteArray, FloatArray, PointCloud

LEAST_SATURATION = 0.1
"""A colour with less saturation counts as grey, because its hue is noise."""


@dataclass(frozen=True, slots=True)
class Hicp(TrimmedIcp):
    """HICP: trimmed ICP with pairs matched by x, y, z and hue; the distances are spatial.

    Source: Men, Gebre, Pochiraju, "Color point cloud registration with 4D ICP algorithm", ICRA 2011.
    Their hue is a number from 0 to 1; here it is an angle, so that all reds are near each other.
    """

    hue_weight_m: float
    """Radius of the hue circle."""

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> Hicp:
        """Return the first state, for two clouds with colours.

        Raises:
            InputError: a cloud has no colours.
        """
        for name, cloud in (("source", source), ("target", target)):
            if cloud.colors is None:
                raise InputError(
                    f"hicp matches by hue, but the {name} cloud has no colours; try another method."
                )
        return cls(config.trim, config.hue_weight_m)

    def features(self, cloud: PointCloud) -> FloatArray | None:
        """Return (N, 2) positions on the hue circle."""
        return None if cloud.colors is None else hue_coordinates(cloud.colors, self.hue_weight_m)


def hue_coordinates(colors: ByteArray, weight_m: float) -> FloatArray:
    """Compute the positions of colours on the hue circle, w (cos 2 pi h, sin 2 pi h).

    Args:
        colors: (N, 3) RGB.
        weight_m: radius w of the circle.

    Returns:
        (N, 2) metres; colours with a saturation below 0.1 are at the centre.
    """
    if not len(colors):
        return np.empty((0, 2))
    rgb = np.asarray(colors, dtype=np.float32)[None] / np.float32(255.0)
    hue_deg, saturation, _ = np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV))[0].T
    angle_rad = np.deg2rad(hue_deg.astype(np.float64))
    circle_m = weight_m * np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    return np.where(saturation[:, None] < LEAST_SATURATION, 0.0, circle_m)
