"""The thesis's robustness experiment, live: noise on the points of the views that are shown (SPEC 1.4)."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np

from app.screens.calibrate.cameras import cameras_of, finished
from app.screens.calibrate.noise_view import NoiseRequest, NoiseView
from app.state import Spec
from app.store import Store
from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import Progress
from pipeline.calibration.estimate import View, calibrate

SHOW_S = 0.25
"""Between two pictures of what there is so far."""


def noise_job(
    store: Store, spec: Spec, request: NoiseRequest
) -> Generator[Progress | NoiseView, None, NoiseView]:
    """Take the calibration that was found as the truth, and see where noise on its points leads.

    Yields:
        What there is so far; the job stops at any of these.

    Raises:
        InputError: the camera has no calibration.
    """
    assert spec.views is not None
    known = yield from finished(cameras_of(store, spec.views))
    camera = known.camera(request.camera)
    if camera is None or camera.calibration is None:
        raise InputError(f"There is no calibration of {request.camera} to repeat; add views first")
    true = camera.calibration
    exact = [
        View(view.name, true.optics.project(view.board_m, view.T_camera_board), view.board_m)
        for view in true.views
    ]
    names = true.names
    view = NoiseView(request, names, np.array([true.parameters[name] for name in names]))
    told_s = time.monotonic()
    found, predicted = [], []
    for trial in range(request.trials):
        rng = np.random.default_rng((14, trial))
        noisy = _with_noise(exact, request.sigma_px, rng)
        try:
            one = calibrate(noisy, true.size_px, true.lens)
        except ReconstructionError:
            continue
        found.append([one.parameters[name] for name in names])
        predicted.append(one.covariance)
        if time.monotonic() - told_s > SHOW_S:
            told_s = time.monotonic()
            yield Progress(f"trial {trial + 1} of {request.trials}", (trial + 1) / request.trials)
            yield _so_far(view, found, predicted)
    return _so_far(view, found, predicted)


def _with_noise(views: Sequence[View], sigma_px: float, rng: np.random.Generator) -> list[View]:
    return [
        replace(view, points_px=view.points_px + sigma_px * rng.standard_normal(view.points_px.shape))
        for view in views
    ]


def _so_far(view: NoiseView, found: list[list[float]], predicted: list[np.ndarray]) -> NoiseView:
    if not found:
        return view
    return replace(view, found=np.array(found), covariance=np.mean(predicted, axis=0))
