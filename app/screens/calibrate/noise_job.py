"""The job of the thesis's robustness experiment: noise on the points of the shown views (SPEC 1.4)."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.calibrate.cameras import cameras_of, finished
from app.screens.calibrate.noise_view import NoiseRequest, NoiseView
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import Progress
from pipeline.calibration.estimate import Calibration, View, calibrate
from pipeline.calibration.lens import Optics
from pipeline.calibration.trust import half_difference_px
from pipeline.types import FloatArray

SHOW_S = 0.25
"""Time between two partial results, seconds."""
HALVED = 8
"""In every eighth trial two halves of the views are compared, which takes three more calibrations."""
AT_M = 2.0
"""Range of that comparison, metres."""
OTHER = np.array([0.0, 0.0, 0.003, -0.002, 0.3])
"""Extra k1, k2, p1, p2 and k3 of the other lens, as of a cheap lens that is mounted askew."""


@dataclass(slots=True)
class _Trials:
    """The completed trials."""

    found: list[list[float]] = field(default_factory=list)
    covariances: list[FloatArray] = field(default_factory=list)
    rms_px: list[float] = field(default_factory=list)
    beyond_noise: list[bool] = field(default_factory=list)

    def view(self, empty: NoiseView) -> NoiseView:
        """Return the result so far."""
        if not self.found:
            return empty
        return replace(
            empty,
            found=np.array(self.found),
            covariance=np.mean(self.covariances, axis=0),
            rms_px=float(np.mean(self.rms_px)),
            halved=len(self.beyond_noise),
            beyond_noise=sum(self.beyond_noise),
        )


def noise_job(
    store: Store, spec: Spec, request: NoiseRequest
) -> Generator[Progress | NoiseView, None, NoiseView]:
    """Take the calibration as the truth, and repeatedly calibrate from its projected points with new noise.

    Yields:
        Partial results; the job can be stopped at each of them.

    Raises:
        InputError: the camera has no calibration, or more distortion is requested for a fisheye.
    """
    assert spec.views is not None
    known = (yield from finished(cameras_of(store, spec.views))).view
    camera = known.camera(request.camera)
    if camera is None or camera.calibration is None:
        raise InputError(f"There is no calibration of {request.camera} to repeat; add photographs first")
    true = camera.calibration
    if request.other_lens and true.lens == "fisheye":
        raise InputError("A fisheye has no p1, p2 and k3 to add; choose 'this lens' under Seen through")
    exact = _seen(true, request.other_lens)
    empty = NoiseView(request, true.names, np.array([true.parameters[name] for name in true.names]))
    trials, reported_s = _Trials(), time.monotonic()
    for trial in range(request.trials):
        halves = request.sigma_px > 0.0 and trial % HALVED == 0
        _repeat(trials, true, _with_noise(exact, request.sigma_px, trial), halves)
        if time.monotonic() - reported_s > SHOW_S:
            reported_s = time.monotonic()
            yield Progress(f"trial {trial + 1} of {request.trials}", (trial + 1) / request.trials)
            yield trials.view(empty)
    return trials.view(empty)


def _seen(true: Calibration, other_lens: bool) -> list[View]:
    """Return the views without noise, through the lens or through the same with more distortion."""
    optics = true.optics
    if other_lens:
        more = np.zeros(max(len(OTHER), true.distortion.size))
        more[: len(OTHER)] = OTHER
        more[: true.distortion.size] += true.distortion
        optics = Optics("rational" if more.size > len(OTHER) else "brown", true.matrix, more)
    return [
        View(view.name, optics.project(view.board_m, view.T_camera_board), view.board_m)
        for view in true.views
    ]


def _with_noise(views: Sequence[View], sigma_px: float, trial: int) -> list[View]:
    rng = np.random.default_rng((14, trial))
    return [
        replace(view, points_px=view.points_px + sigma_px * rng.standard_normal(view.points_px.shape))
        for view in views
    ]


def _repeat(trials: _Trials, true: Calibration, noisy: Sequence[View], halves: bool) -> None:
    """Add a trial, unless its views do not determine the lens."""
    try:
        one = calibrate(noisy, true.size_px, true.lens)
    except PacketMeshError:
        return
    trials.found.append([one.parameters[name] for name in one.names])
    trials.covariances.append(one.covariance)
    trials.rms_px.append(one.rms_px)
    if halves:
        try:
            apart = half_difference_px(noisy, true.size_px, AT_M, true.lens)
        except PacketMeshError:  # too few views for halves
            return
        trials.beyond_noise.append(apart.beyond_noise)
