"""Verdicts on a simulated session: ours, those of two limits of the reprojection error, and those of
mrcal.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from lab.verdicts.session import Session, draw_session
from lab.verdicts.truth import truly_good
from packetmesh.errors import PacketMeshError
from pipeline.calibration.estimate import Calibration, calibrate
from pipeline.calibration.lens import Optics
from pipeline.calibration.likely_error import likely_error
from pipeline.calibration.trust import sight
from pipeline.calibration.verdict import LEAST_SHARE, verdict

RMS_LIMITS_PX = (0.5, 1.0)
"""Limits of the RMS reprojection error below which a calibration is often called good."""
MRCAL_PYTHON = "/usr/bin/python3"
"""Python for which Debian installs mrcal (``apt-get install python3-mrcal``)."""
SCRIPT = Path(__file__).with_name("mrcal_script.py")
OURS, RMS, MRCAL = "packetmesh", "OpenCV, RMS below {:g} px", "mrcal, {}"


def judge(task: tuple[int, int, bool]) -> dict[str, Any]:
    """Draw and calibrate a session; return its properties, our probability, and the verdicts by rule.

    Each verdict has whether the camera that it judges is truly good. If the calibration fails, there are no
    verdicts and no probability.

    Args:
        task: seed and number of the session, and whether mrcal judges it, too.
    """
    seed, number, with_mrcal = task
    session = draw_session(seed, number)
    answer: dict[str, Any] = {
        "lens": session.optics.lens,
        "chosen": session.chosen,
        "right_lens": session.right_lens,
        "views": session.kind,
        "bent": session.bend_m > 0.0,
        "blurred": session.blurred > 0,
        "verdicts": {},
    }
    try:
        found = calibrate(session.views, session.size_px, session.chosen)
    except PacketMeshError:
        return answer
    good = truly_good(session, found.optics)
    judged = verdict(found, likely_error(found, session.range_m), session.accuracy_m)
    answer["probability"], answer["good"] = judged.probability, good
    answer["verdicts"][OURS] = {"word": judged.word, "good": good}
    for limit_px in RMS_LIMITS_PX:
        word = "pass" if found.rms_px < limit_px else "fail"
        answer["verdicts"][RMS.format(limit_px)] = {"word": word, "good": good}
    if with_mrcal:
        answer["verdicts"] |= _by_mrcal(session, found)
    return answer


def _mrcal_input(session: Session, found: Calibration) -> dict[str, Any]:
    """Return a session as ``mrcal_script.py`` reads it; mrcal starts at our camera and poses."""
    columns, rows = session.board.grid
    seen = sight(found.optics, session.size_px, session.range_m)
    grid_px = np.stack(np.meshgrid(seen.columns_px, seen.rows_px), axis=-1).reshape(-1, 2)
    poses = [view.T_camera_board for view in found.views]
    corner_m = session.board.points_m[0]
    rt = [[*cv2.Rodrigues(T[:3, :3])[0].ravel(), *(T[:3, :3] @ corner_m + T[:3, 3])] for T in poses]
    k = found.matrix
    return {
        "points_px": [view.points_px.reshape(rows, columns, 2).tolist() for view in session.views],
        "rt": [[float(value) for value in one] for one in rt],
        "lens": session.chosen,
        "start": [k[0, 0], k[1, 1], k[0, 2], k[1, 2], *found.distortion.ravel().tolist()],
        "size_px": list(session.size_px),
        "spacing_m": session.board.spacing_m,
        "grid_px": grid_px.tolist(),
        "range_m": session.range_m,
        "columns": len(seen.columns_px),
        "rows": len(seen.rows_px),
    }


def mrcal_installed(python: str = MRCAL_PYTHON) -> bool:
    """Return whether this Python exists and can import mrcal."""
    if shutil.which(python) is None:
        return False
    return not subprocess.run([python, "-c", "import mrcal"], capture_output=True, check=False).returncode


def _by_mrcal(session: Session, found: Calibration) -> dict[str, dict[str, Any]]:
    """Return mrcal's verdicts by rule; empty if mrcal fails or does not have the lens model."""
    if session.chosen == "fisheye":
        return {}
    given = json.dumps(_mrcal_input(session, found))
    done = subprocess.run(
        [MRCAL_PYTHON, str(SCRIPT)], input=given, capture_output=True, text=True, check=False
    )
    if done.returncode:
        return {}
    answer = json.loads(done.stdout)
    good = truly_good(session, _optics(answer["camera"], session))
    verdicts = {}
    for name, error_m in (("uncertainty", answer["uncertainty_m"]), ("two halves", answer["apart_m"])):
        if error_m is not None:
            share = np.mean(np.nan_to_num(np.array(error_m, float), nan=np.inf) <= session.accuracy_m)
            verdicts[MRCAL.format(name)] = {"word": "pass" if share >= LEAST_SHARE else "fail", "good": good}
    return verdicts


def _optics(values: Sequence[float], session: Session) -> Optics:
    """Return mrcal's camera as a lens of ours."""
    fx, fy, cx, cy, *distortion = values
    full = np.zeros(8 if session.chosen == "rational" else 5)
    full[: len(distortion)] = distortion
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Optics("rational" if session.chosen == "rational" else "brown", matrix, full)
