"""How far a camera is to be trusted at a range, as pictures over its image and in words."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from app.screens.calibrate.job import camera_of
from app.screens.calibrate.maps import coverage_picture, map_picture, next_picture
from app.screens.calibrate.request import board_of
from app.screens.calibrate.view import CameraView, TrustRequest, TrustView
from app.state import Spec
from app.store import Store
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import Progress
from pipeline.calibration.board import Board
from pipeline.calibration.diagnosis import coverage, radial_curve, radial_residuals
from pipeline.calibration.estimate import Calibration, View
from pipeline.calibration.next_view import NextView, next_view
from pipeline.calibration.trust import CIRCLE95, HalfDifference, half_difference_px, projected_sd_px
from pipeline.calibration.verdict import Verdict, verdict
from pipeline.types import FloatArray

FAR_BEYOND = 2.0
"""Times what noise explains: from there on a difference is told that does not matter for what is asked."""
WIDER = {"thesis": "brown", "brown": "rational", "rational": "fisheye", "fisheye": "rational"}


def trust_job(store: Store, spec: Spec, request: TrustRequest) -> Generator[Progress, None, TrustView]:
    """Judge a camera.

    Raises:
        InputError: it has no lens, or the range makes no sense.
    """
    views = spec.views
    assert views is not None
    camera = yield from camera_of(store, views, request.camera)

    def judge() -> Generator[Progress, None, TrustView]:
        yield Progress(f"trust in {camera.name}", 0.5)
        return _judged(camera, request, board_of(views))

    key = ("trust", views.folder, views.edition, board_of(views), views.lens, camera.dropped, request)
    return (yield from store.remember(key, judge))


def _judged(camera: CameraView, request: TrustRequest, board: Board) -> TrustView:
    lens = camera.calibration
    if lens is None:
        raise InputError(camera.reason)
    sd = projected_sd_px(lens, request.range_m)
    halves = _halves(lens, request.range_m)
    following = _following(lens, board, request.range_m)
    judged = verdict(lens, sd, halves, request.accuracy_m, following)
    zoom = camera.photographs[0].zoom
    size_px = (round(lens.size_px[0] * zoom), round(lens.size_px[1] * zoom))
    noise_m = CIRCLE95 * sd.error_m
    apart_m = None if halves is None else halves.map.error_m
    most_m = _most_m(noise_m, apart_m)
    at = f"at {request.range_m:g} m"
    pictures = {
        "uncertainty": map_picture(noise_m, most_m, size_px, f"Noise leaves a point {at} within, 95 %"),
        "coverage": coverage_picture(coverage(lens.views, lens.size_px), lens.views, zoom, size_px),
    }
    if apart_m is not None:
        told = f"Two halves of the views put a point {at} apart by"
        pictures["halves"] = map_picture(apart_m, most_m, size_px, told)
    if following is not None:
        pictures["next"] = next_picture(following, lens, zoom, size_px)
    return TrustView(
        request,
        judged.passed,
        _lines(judged, lens, halves, following),
        pictures,
        radial_curve(lens),
        radial_residuals(lens),
        _rms(noise_m),
        None if apart_m is None else _rms(apart_m),
        None if halves is None else (halves.rms_px, halves.noise_px),
    )


def _halves(lens: Calibration, range_m: float) -> HalfDifference | None:
    """None where there are too few views for halves, or one of them does not determine the lens."""
    views = [View(one.name, one.points_px, one.board_m) for one in lens.views]
    try:
        return half_difference_px(views, lens.size_px, range_m, lens.lens)
    except PacketMeshError:
        return None


def _following(lens: Calibration, board: Board, range_m: float) -> NextView | None:
    try:
        return next_view(lens, board, range_m)
    except PacketMeshError:
        return None


def _lines(
    judged: Verdict, lens: Calibration, halves: HalfDifference | None, following: NextView | None
) -> tuple[str, ...]:
    """The verdict, and what to do in the words of the screen."""
    asked = f"{1000.0 * judged.accuracy_m:g} mm at {judged.range_m:g} m"
    most = 1000.0 * judged.error_of_most_m
    reached = f"{most:.2g} mm" if np.isfinite(most) else "more than can be told"
    lines = [
        f"{'Good enough' if judged.passed else 'Not good enough'} for {asked}: a point is placed as well over "
        f"{judged.share:.0%} of the image, and within {reached} over 95 % of it."
    ]
    if halves is not None and halves.beyond_noise and (not judged.passed or _far_beyond(halves)):
        lines.append(
            f"Two halves of the views differ by {halves.rms_px:.2g} px, where noise explains "
            f"{halves.noise_px:.2g}: the lens is of the wrong kind, or a view or the board is. Try the lens "
            f"{WIDER[lens.lens]} under Advanced, or drop views that stand out."
        )
    if not judged.passed and following is not None:
        lines.append(
            f"The view to take next (Right side) would bring {1000.0 * following.error_before_m:.2g} mm to "
            f"{1000.0 * following.error_after_m:.2g} mm."
        )
    return tuple(lines)


def _far_beyond(halves: HalfDifference) -> bool:
    """Whether there is more than noise to a difference that is small enough for what is asked."""
    return halves.rms_px > FAR_BEYOND * halves.noise_px


def _most_m(noise_m: FloatArray, apart_m: FloatArray | None) -> float:
    """Both maps share their colours, so that they can be compared by eye."""
    every = noise_m if apart_m is None else np.concatenate([noise_m, apart_m])
    known = every[np.isfinite(every)]
    return float(np.quantile(known, 0.98)) if len(known) else 1.0


def _rms(error_m: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(error_m**2)))
