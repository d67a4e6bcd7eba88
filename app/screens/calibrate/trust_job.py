"""The job that judges a camera at a range: maps over its image, and sentences."""

from __future__ import annotations

from collections.abc import Generator, Iterator

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.calibrate.cameras import cameras_of, finished
from app.screens.calibrate.maps import coverage_picture, map_picture, next_picture
from app.screens.calibrate.view import CameraView, TrustRequest, TrustView
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.calibration.assess import Trust, assess
from pipeline.calibration.board import Board
from pipeline.calibration.correlation import correlations
from pipeline.calibration.diagnosis import radial_curve, radial_residuals
from pipeline.calibration.estimate import Calibration, View
from pipeline.calibration.trust import CIRCLE95
from pipeline.calibration.verdict import CERTAIN, percent
from pipeline.types import FloatArray


def trust_job(store: Store, spec: Spec, request: TrustRequest) -> Generator[Progress, None, TrustView]:
    """Return the verdict on a camera.

    Raises:
        InputError: it has no lens, or the range is invalid.
    """
    views = spec.views
    assert views is not None
    known = (yield from finished(cameras_of(store, views))).view
    camera = known.camera(request.camera)
    if camera is None or camera.calibration is None:
        raise InputError(f"{request.camera} has no lens to judge; add views of the board first")

    def judge() -> Generator[Progress, None, TrustView]:
        yield Progress(f"trust in {camera.name}", 0.5)
        return _trust_view(camera, request, known.board, len(known.cameras) == 1 and not views.bent)

    return (yield from store.remember(("trust", views, request), judge))


def _trust_view(camera: CameraView, request: TrustRequest, board: Board, may_bend: bool) -> TrustView:
    """Return the verdict; ``may_bend``: whether the advice may be to allow a bent board."""
    lens = camera.calibration
    assert lens is not None
    views = [View(one.name, one.points_px, one.board_m) for one in lens.views]
    trust = assess(lens, views, board, request.range_m, request.accuracy_m)
    zoom = camera.photographs[0].zoom
    size_px = (round(lens.size_px[0] * zoom), round(lens.size_px[1] * zoom))
    noise_m = CIRCLE95 * trust.sd.error_m
    apart_m = None if trust.halves is None else trust.halves.map.error_m
    most_m = _most_m(noise_m, apart_m)
    at = f"at {request.range_m:g} m"
    pictures = {
        "uncertainty": map_picture(noise_m, most_m, size_px, f"Error of a point {at} from noise (95 %):"),
        "coverage": coverage_picture(trust.coverage, lens.views, zoom, size_px),
    }
    if apart_m is not None:
        pictures["halves"] = map_picture(
            apart_m, most_m, size_px, f"Difference of the two halves for a point {at}:"
        )
    if trust.following is not None:
        pictures["next"] = next_picture(trust.following, lens, zoom, size_px)
    return TrustView(
        request,
        trust.verdict.passed,
        trust.verdict.failed,
        tuple(_lines(trust, lens, may_bend)),
        tuple(one.name for one in trust.outliers),
        pictures,
        radial_curve(lens),
        radial_residuals(lens),
        _rms(noise_m),
        None if apart_m is None else _rms(apart_m),
        None if trust.halves is None else (trust.halves.ratio, trust.halves.most_by_noise),
        correlations(lens),
    )


def _lines(trust: Trust, lens: Calibration, may_bend: bool) -> Iterator[str]:
    """Yield the verdict and the advice, as the screen shows them."""
    judged, following = trust.verdict, trust.following
    target = f"{1000.0 * judged.accuracy_m:g} mm at {judged.range_m:g} m"
    most = 1000.0 * judged.error_of_most_m
    reached = (
        f"and within {most:.2g} mm with a probability of 95 %"
        if np.isfinite(most)
        else "but more than 5 % of it has no rays, where the lens model folds back"
    )
    good = "Good" if judged.passed else "Not good" if judged.failed else "Not known to be good"
    yield (
        f"{good} enough for {target}: points are within that over 95 % of the image with a probability of "
        f"{percent(judged.probability)}, {reached}."
    )
    lens_wrong, bent = judged.wrong_lens >= CERTAIN, judged.bent >= CERTAIN
    if (lens_wrong or bent) and not judged.passed:
        if lens_wrong:
            yield "The residuals have a pattern that this lens model leaves: try another lens under Advanced."
        if bent:
            allow = ", or allow a bent board under Advanced" if may_bend else ""
            yield f"The residuals have the pattern of a bent board: glue it onto a flat plate{allow}."
    elif following is not None and not judged.passed:
        yield (
            "The next view to take (under Compare) is predicted to reduce the error from "
            f"{1000.0 * following.error_before_m:.2g} mm to {1000.0 * following.error_after_m:.2g} mm."
        )
    if trust.outliers:
        names = ", ".join(one.name for one in trust.outliers)
        worst = trust.outliers[0]
        yield (
            f"Outlier: view {names}, red below; {worst.name} has {worst.rms_px:.2f} px, the others "
            f"{worst.others_px:.2f} px. Look at its photograph, and drop it if it is bad."
        )


def _most_m(noise_m: FloatArray, apart_m: FloatArray | None) -> float:
    """Upper end of the colour scale that both maps share, metres."""
    every = noise_m if apart_m is None else np.concatenate([noise_m, apart_m])
    known = every[np.isfinite(every)]
    return float(np.quantile(known, 0.98)) if len(known) else 1.0


def _rms(error_m: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(error_m**2)))
