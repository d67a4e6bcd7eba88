"""C01 to C08: the thesis's claims about its calibration, tested by the experiments of SPEC 1.4."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lab.claims.calibration.protocol import (
    EULER_DEG,
    MOVE_M,
    SIGMAS_PX,
    TRIALS,
    TRUTH,
    VIEWS,
    CalibrationStudy,
    calibration_study,
)
from lab.claims.claim import Claim, Outcome, bootstrap_ci95
from lab.claims.exhibits import Table
from pipeline.calibration.thesis_table import TABLE_4_1
from pipeline.types import FloatArray

PLACES = ("fx", "fy", "cx", "cy")
WITHIN, WITHIN_POSE = 0.005, 0.05
EXACT = 1e-3
"""Largest error without noise that counts as none."""
TABLE_4_2 = (
    (60.173, -10.193, 17.757, 30.0027, 19.9969, 18.0053),
    (60.237, -9.661, 18.329, 29.9965, 20.0053, 18.0072),
    (59.538, -10.472, 18.517, 30.0051, 20.003, 17.9929),
    (60.621, -10.613, 17.104, 30.0062, 20.0089, 17.9892),
    (60.126, -10.169, 17.973, 30.002, 21.67, 17.999),
)
LAST_ROW = (0.3535, 0.3422, 0.5001, 0.0035, 40794.0, 0.0071)
"""Last row of Table 4.2, which the table labels as noise 1.0."""
MISPRINT = 4
"""Column (ty) of 21.67 and 40794."""


def rmse(values: FloatArray) -> float:
    """Return the root mean square."""
    return float(np.sqrt((values**2).mean()))


def within_share(cell: dict[str, FloatArray]) -> FloatArray:
    """Return (TRIALS,) 1 for each trial with fx, fy, cx and cy all within 0.5 %, else 0."""
    relative = np.array([np.abs(cell[name]) / TRUTH[name] for name in PLACES])
    return (relative <= WITHIN).all(axis=0).astype(float)


def cells_table(study: CalibrationStudy) -> Table:
    """Return a table of every cell of E1."""
    rows = []
    for (views, sigma), cell in study.joint.items():
        errors = [rmse(cell[name]) for name in TRUTH]
        z = (
            np.concatenate([cell[name] / cell[f"sd_{name}"] for name in TRUTH])
            if sigma
            else np.array([np.nan])
        )
        rows.append(
            (
                *(views, sigma, *errors, 100.0 * float(within_share(cell).mean())),
                *(float(cell["rms_px"].mean()), float(cell["held_out_px"].mean())),
                *(float(cell["rotation_deg"].mean()), 100.0 * float(cell["translation"].mean())),
                None if not sigma else float(z.std()),
            )
        )
    return Table(
        "E1: lens and poses together",
        (
            *("views", "noise, px", *(f"RMSE {name}" for name in TRUTH), "all four within 0.5 %, %"),
            *("RMS, px", "held-out RMS, px", "rotation, °", "translation, %", "sd of error / predicted"),
        ),
        tuple(rows),
        f"{TRIALS} trials a cell, each with views and noise of its own; four more views are held out. The "
        "last column is 1 where the standard errors that are predicted are right.",
    )


def _c01(study: CalibrationStudy) -> Outcome:
    found = np.array([one["found"] for one in study.photographs])
    upright = np.array([one["upright"] for one in study.photographs])
    errors = np.array(
        [one["error_px"] if one["error_px"] is not None else np.nan for one in study.photographs]
    )
    ours = {"found_share": float(found.mean()), "upright_share": float(upright.mean())}
    ours |= {"mean_error_px": float(np.nanmean(errors)), "largest_mean_error_px": float(np.nanmax(errors))}
    return Outcome(
        ours,
        {"mean_error_px": bootstrap_ci95(errors[np.isfinite(errors)])},
        ours["found_share"] == 1.0 and ours["largest_mean_error_px"] < 0.15,
        f"the 99 circles are found in {int(found.sum())} of {len(found)} rendered photographs tilted by up "
        f"to 50°, {int(upright.sum())} of them the right way up by the mark; centres are off by "
        f"{ours['mean_error_px']:.3f} px in the mean, {ours['largest_mean_error_px']:.3f} in the worst view",
    )


def _c02(study: CalibrationStudy) -> Outcome:
    ratios = {
        sigma: cell["held_out_px"].mean() / cell["rms_px"].mean()
        for (views, sigma), cell in study.joint.items()
        if views == 4 and sigma
    }
    ours = {f"held_out_over_rms_{sigma:g}_px": float(ratio) for sigma, ratio in ratios.items()}
    return Outcome(
        ours,
        {},
        all(1.0 <= ratio <= 1.1 for ratio in ratios.values()),
        f"with four views the error in four held-out views is {min(ratios.values()):.3f} to "
        f"{max(ratios.values()):.3f} times that in those that were used",
        (cells_table(study),),
    )


def _c03(study: CalibrationStudy) -> Outcome:
    exact = max(
        float(np.abs(cell[name]).max())
        for (_, sigma), cell in study.joint.items()
        if not sigma
        for name in TRUTH
    )
    outside, rows = [], []
    for sigma, printed in TABLE_4_1.items():
        for name, value in zip(TRUTH, printed, strict=True):
            error = value - TRUTH[name]
            spread = {views: rmse(study.joint[views, sigma][name]) for views in (4, 8)}
            rows.append((sigma, name, value, error, spread[4], spread[8]))
            if name in PLACES and abs(error) > 3.0 * max(spread.values()):
                outside.append(f"{name} at {sigma:g} px")
    ours = {"largest_error_without_noise": exact, "entries_outside": float(len(outside))}
    agreeing = "all" if not outside else f"all but {', '.join(outside)} of the"
    return Outcome(
        ours,
        {},
        exact < EXACT and not outside,
        f"without noise the camera is found to {exact:.1e}; {agreeing} printed focal lengths and centres of "
        "Table 4.1 lie within three RMSE of ours with 4 or 8 views",
        (
            Table(
                "Table 4.1 beside E1",
                ("noise, px", "parameter", "printed", "its error", "RMSE, 4 views", "RMSE, 8 views"),
                tuple(rows),
                "One value is printed for each noise; the table does not state of how many runs it is.",
            ),
        ),
    )


def _c04(study: CalibrationStudy) -> Outcome:
    worst = {
        sigma: max(rmse(study.joint[8, sigma][name]) / TRUTH[name] for name in PLACES)
        for sigma in SIGMAS_PX
        if sigma
    }
    shares = {sigma: within_share(study.joint[8, sigma]) for sigma in worst}
    ours = {f"worst_rmse_share_{sigma:g}_px": value for sigma, value in worst.items()}
    ours |= {f"within_share_{sigma:g}_px": float(share.mean()) for sigma, share in shares.items()}
    return Outcome(
        ours,
        {f"within_share_{sigma:g}_px": bootstrap_ci95(share) for sigma, share in shares.items()},
        all(value < WITHIN for sigma, value in worst.items() if sigma <= 0.7),
        f"with 8 views the RMSE of the worst of the four is {worst[0.7]:.2%} at 0.7 px and {worst[1.0]:.2%} "
        f"at 1 px; all four are within 0.5 % in {shares[0.5].mean():.0%} of the runs at 0.5 px and in "
        f"{shares[1.0].mean():.0%} at 1 px: typical, not certain",
    )


def _c05(study: CalibrationStudy) -> Outcome:
    truth = np.array([*EULER_DEG, *MOVE_M])
    within = {
        sigma: (np.abs(errors / truth) <= WITHIN_POSE).all(axis=1).astype(float)
        for sigma, errors in study.pose.items()
    }
    errors = study.pose[1.0]
    ours = {
        "within_share_1_px": float(within[1.0].mean()),
        "worst_share": float(np.abs(errors / truth).max()),
    }
    ours |= {f"rmse_{name}_deg": rmse(errors[:, axis]) for axis, name in enumerate("xyz")}
    ours |= {f"rmse_{name}_m": rmse(errors[:, 3 + axis]) for axis, name in enumerate("xyz")}
    return Outcome(
        ours,
        {"within_share_1_px": bootstrap_ci95(within[1.0])},
        all(share.mean() == 1.0 for share in within.values()),
        f"with a known lens all six are within 5 % in {within[1.0].mean():.0%} of the trials at 1 px, the "
        f"worst off by {ours['worst_share']:.1%}; the thesis's own table is not: -10.613 is 6.1 % off -10",
    )


def _c06(study: CalibrationStudy) -> Outcome:
    cell = study.joint[8, 1.0]
    relative = {name: rmse(cell[name]) / TRUTH[name] for name in TRUTH}
    ratio = min(relative["k1"], relative["k2"]) / max(relative["fx"], relative["fy"])
    return Outcome(
        {f"relative_rmse_{name}": value for name, value in relative.items()} | {"ratio": ratio},
        {},
        ratio > 10.0,
        f"at 1 px with 8 views k1 is off by {relative['k1']:.0%} and k2 by {relative['k2']:.0%}, the focal "
        f"length by {relative['fx']:.2%}: at least {ratio:.0f} times as much",
    )


def _c07(study: CalibrationStudy) -> Outcome:
    shares = {views: within_share(study.joint[views, 0.5]) for views in VIEWS}
    return Outcome(
        {f"within_share_{views}_views": float(share.mean()) for views, share in shares.items()},
        {f"within_share_{views}_views": bootstrap_ci95(share) for views, share in shares.items()},
        bool(shares[8].mean() >= 0.8),
        "at 0.5 px all four intrinsics are within 0.5 % in "
        + ", ".join(f"{share.mean():.0%} of the runs with {views} views" for views, share in shares.items()),
    )


def _c08() -> Outcome:
    rows = np.array(TABLE_4_2)
    spread = rows.std(axis=0)
    right = [column for column in range(rows.shape[1]) if column != MISPRINT]
    off = {column: abs(spread[column] - LAST_ROW[column]) / LAST_ROW[column] for column in right}
    mended = rows[:, MISPRINT].copy()
    mended[4] = 20.0
    ours = {"largest_deviation": max(off.values()), "sd_ty": float(spread[MISPRINT])}
    ours["sd_ty_with_20_for_21_67"] = float(mended.std())
    return Outcome(
        ours,
        {},
        ours["largest_deviation"] <= 0.05 and ours["sd_ty_with_20_for_21_67"] < 0.01,
        "the row of 1.0 is no noise level: in five columns it is the standard deviation of the rows above, "
        f"within {ours['largest_deviation']:.1%}; 40794 is a misprint of 0.0040794, and 21.67 of about "
        f"20.00, with which ty's would be {ours['sd_ty_with_20_for_21_67']:.4f}, not {ours['sd_ty']:.2f}",
    )


def _claim(
    id_: str, claim: str, thesis: str, tolerance: str, experiment: Callable[[CalibrationStudy], Outcome]
) -> Claim:
    return Claim(id_, claim, thesis, tolerance, experiment, calibration_study)


CLAIMS = (
    _claim(
        "C01",
        "The 99 circles of the 9 x 11 board are found in its images (Fig. 3.5)",
        "a figure",
        "all of 40 rendered photographs of 1380 x 1030 pixels up to 50° of tilt, in each a mean error of the "
        "centres below 0.15 px",
        _c01,
    ),
    _claim(
        "C02",
        "Four views estimate, four are held out",
        "no number",
        "held-out over used RMS from 1.0 to 1.1 with four views, at every noise",
        _c02,
    ),
    _claim(
        "C03",
        "The camera is recovered under noise of 0 to 1 px (Table 4.1)",
        "500.000 to 502.474, 250.000 to 251.043 and so on",
        "exact without noise; every printed focal length and centre within three RMSE of our 4 or 8 views",
        _c03,
    ),
    _claim(
        "C04",
        "Intrinsics are within 0.5 %",
        "0.495 % at most",
        "RMSE below 0.5 % up to 0.7 px with 8 views; the share of runs is reported",
        _c04,
    ),
    _claim(
        "C05",
        "Extrinsics are within 5 %",
        "5 %; its table has 6.1 %",
        "all of 200 trials at each noise up to 1 px",
        _c05,
    ),
    _claim(
        "C06",
        "The radial terms are very sensitive to noise",
        "k1 off by 176 % at 1 px",
        "relative RMSE of k1 and k2 over that of the focal length above 10 at 1 px",
        _c06,
    ),
    _claim(
        "C07",
        "Noise has to stay below 0.5 px",
        "0.5 px",
        "all four intrinsics within 0.5 % in at least 80 % of the runs at 0.5 px with 8 views",
        _c07,
    ),
    Claim(
        "C08",
        "Table 4.2 has thirty extrinsic values and a last row at noise 1.0",
        ".3535, .3422, .5001, .0035, 40794, .0071",
        "the last row is the standard deviation of the five above within 5 %, without its misprints",
        _c08,
        by_definition=True,
    ),
)
