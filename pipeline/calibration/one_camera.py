"""Check, by the fit, that one camera took all images of a folder whose names form several series."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.estimate import LEAST_VIEWS, Calibration, View, best_fit, rms_px
from pipeline.calibration.series import same_moments

WORSE = 1.5
"""The images are of several cameras if one camera for all has more than this many times the RMS of one
camera for each series of names."""


def check_series_agree(found: Calibration, views: Sequence[View], paths: Mapping[str, Path]) -> None:
    """Check that one camera fits all images about as well as one per series of names (front_1, back_1).

    Args:
        found: the camera calibrated from all views.
        views: its views.
        paths: image files by the names of views.

    Raises:
        InputError: a camera for each series fits much better.
    """
    series = same_moments([paths[view.name] for view in views])
    if not series:
        return
    groups = [[view for view in views if paths[view.name] in files] for files in series.values()]
    if min(map(len, groups)) < LEAST_VIEWS:
        return
    try:
        alone = [best_fit(group, found.size_px, found.lens) for group in groups]
    except ReconstructionError:
        return
    alone_px = rms_px(np.concatenate([view.residuals_px for one in alone for view in one.views]))
    if found.rms_px > WORSE * alone_px:
        counts = " and ".join(f"{len(files)} of '{name}'" for name, files in series.items())
        raise InputError(
            f"The images are of {len(series)} cameras or focal lengths: {counts}. One camera misses their "
            f"points by {found.rms_px:.2g} px (RMS), and one for each by {alone_px:.2g} px. Give each "
            "camera's images a folder of its own, or add --rig to calibrate the cameras together; to use "
            "one camera for all anyway, add --one-camera"
        )
