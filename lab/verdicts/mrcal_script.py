"""mrcal's results on a simulated session: its camera, its uncertainty, and the difference of two halves.

The Python for which mrcal is installed runs this script. It need not be that of PacketMesh, of which the
script imports nothing. The script reads a session as JSON from standard input and prints JSON.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import mrcal
import numpy as np

MODELS = {
    "thesis": ("LENSMODEL_OPENCV4", 4),
    "brown": ("LENSMODEL_OPENCV5", 5),
    "rational": ("LENSMODEL_OPENCV8", 8),
}
"""mrcal's lens model and its number of distortion parameters; it has none for a fisheye of Kannala and
Brandt.
"""


def camera(
    points_px: np.ndarray,
    rt: np.ndarray,
    lens: str,
    start: np.ndarray,
    size_px: list[int],
    spacing_m: float,
) -> Any:
    """Return the camera that mrcal fits to (V, H, W, 2) points.

    It starts at the (V, 6) poses ``rt`` of the boards and at ``start``: fx, fy, cx, cy and distortion.
    """
    name, count = MODELS[lens]
    views = len(points_px)
    weights = np.ones((*points_px.shape[:3], 1))
    distortion = np.zeros(count)
    known = start[4 : 4 + count]
    distortion[: len(known)] = known
    inputs = {
        "lensmodel": name,
        "intrinsics": np.concatenate([start[:4], distortion])[None],
        "extrinsics_rt_fromref": np.zeros((0, 6)),
        "frames_rt_toref": rt.copy(),
        "points": None,
        "observations_board": np.ascontiguousarray(np.concatenate([points_px, weights], axis=3)),
        "indices_frame_camintrinsics_camextrinsics": np.ascontiguousarray(
            np.column_stack([np.arange(views), np.zeros(views), -np.ones(views)]).astype(np.int32)
        ),
        "observations_point": None,
        "indices_point_camintrinsics_camextrinsics": None,
        "imagersizes": np.array([size_px], np.int32),
        "calibration_object_spacing": float(spacing_m),
        "calobject_warp": np.zeros(2),
        "do_optimize_intrinsics_core": True,
        "do_optimize_intrinsics_distortions": True,
        "do_optimize_extrinsics": True,
        "do_optimize_frames": True,
        "do_optimize_calobject_warp": True,
        "do_apply_regularization": True,
        "do_apply_outlier_rejection": True,
        "verbose": False,
    }
    mrcal.optimize(**inputs)
    return mrcal.cameramodel(optimization_inputs=inputs, icam_intrinsics=0)


def judged(one: dict[str, Any]) -> dict[str, Any]:
    """Return mrcal's camera and the (G,) errors in metres by its uncertainty and by two halves of the views.

    The halves are the even and the odd views; with fewer than six views their error is None. mrcal finds the
    transformation between their cameras on a grid of its own, and the errors are those at the (G, 2) pixels
    ``grid_px``, as the uncertainty is.
    """
    points_px, rt, grid_px = (np.array(one[name], float) for name in ("points_px", "rt", "grid_px"))
    how = one["lens"], np.array(one["start"], float), one["size_px"], one["spacing_m"]
    range_m = one["range_m"]
    model = camera(points_px, rt, *how)
    kind, values = model.intrinsics()
    rays = mrcal.unproject(grid_px, kind, values, normalize=True)
    pixel_m = range_m * np.mean(
        [
            np.linalg.norm(mrcal.unproject(grid_px + step, kind, values, normalize=True) - rays, axis=1)
            for step in ((1.0, 0.0), (0.0, 1.0))
        ],
        axis=0,
    )
    sd_px = mrcal.projection_uncertainty(range_m * rays, model, what="worstdirection-stdev")
    apart_m = None
    if len(points_px) >= 6:
        halves = [camera(points_px[first::2], rt[first::2], *how) for first in (0, 1)]
        Rt = mrcal.projection_diff(
            halves, gridn_width=one["columns"], gridn_height=one["rows"], distance=range_m
        )[3]
        even, odd = (half.intrinsics() for half in halves)
        points_m = range_m * mrcal.unproject(grid_px, *even, normalize=True)
        moved_px = mrcal.project(mrcal.transform_point_Rt(Rt, points_m), *odd)
        apart_m = (np.linalg.norm(moved_px - grid_px, axis=1) * pixel_m).tolist()
    return {
        "camera": values.tolist(),
        "uncertainty_m": (2.4477 * sd_px * pixel_m).tolist(),
        "apart_m": apart_m,
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(judged(json.load(sys.stdin))) + "\n")
