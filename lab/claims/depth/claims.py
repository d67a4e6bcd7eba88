"""C12 to C14: the thesis's claims about its depth network, tested on our images (SPEC 3.4 and 8)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from pathlib import Path

import numpy as np

from lab.claims.claim import Claim, Outcome, bootstrap_ci95, mean_curve
from lab.claims.depth.errors import (
    ALIGNMENTS,
    CHAIN,
    JUDGED,
    SENSOR,
    WORST_SHOWN,
    SceneErrors,
    distance_curve,
    from_trial,
    site_trial,
)
from lab.claims.depth.scenes import HELD_OUT, VIEWS_PER_ROOM, real_folders, set_paths, sites
from lab.claims.exhibits import Chart, Curve, Picture, Table
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.io.demos import SCENES

TABLE_4_3 = ((6.328, 0.284, 0.206), (7.944, 0.339, 0.361), (5.647, 0.236, 0.161))
"""RMSE (metres), RMSE log and REL of the thesis's three scenes."""
PRINTED = {"rmse_mean_m": 6.640, "rmse_sd_m": 0.963, "abs_rel_mean": 0.243, "abs_rel_sd": 0.086}
"""Thesis 4.2, below the table."""
HALF_DIGIT = 0.0005 + 1e-9
"""Largest rounding error of a number that is printed with three decimals."""
TARGET_ABS_REL = 0.25
MEASURES = ("rmse_m", "rmse_log", "abs_rel", "delta_1", "delta_2", "delta_3")
HEADINGS = ("RMSE (m)", "RMSE log", "AbsRel", "δ1", "δ2", "δ3")
NOTES = {
    "raw": "The network's numbers taken as metres.",
    "median-scaled": "Times the ratio of the medians of true and inferred depth, image by image.",
    "affine-aligned": "By a robust line from inferred to true depth, image by image.",
}


def infer_all(folder: Path, scheduler: str | None) -> Generator[Progress, None, tuple[SceneErrors, ...]]:
    """Infer the depth of all images of all sites and compare it with their references."""
    data = (SHIPPED_MODEL, SCENES, *real_folders(), *set_paths())
    found = yield from iterate_trials("C12 and C14, depth", site_trial, sites(), folder, scheduler, data=data)
    return tuple(from_trial(site, result) for site, result in zip(sites(), found, strict=True))


def judge_errors(measured: Sequence[SceneErrors]) -> Outcome:
    """Return C12's numbers and verdict; the three held-out scenes decide, all others are only reported."""
    ours = {
        f"abs_rel_{alignment}_{scene.site.name}": scene.mean(alignment, "abs_rel")
        for scene in measured
        for alignment in ALIGNMENTS
    }
    ours |= {f"delta_1_{JUDGED}_{scene.site.name}": scene.mean(JUDGED, "delta_1") for scene in measured}
    held_out = [scene for scene in measured if scene.site.group == HELD_OUT]
    others = [scene for scene in measured if scene.site.group != HELD_OUT]
    abs_rel = [scene.mean(JUDGED, "abs_rel") for scene in held_out]
    elsewhere = "; ".join(f"{scene.site.name} {scene.mean(JUDGED, 'abs_rel'):.3f}" for scene in others)
    return Outcome(
        ours,
        {f"abs_rel_{JUDGED}_{scene.site.name}": _ci95_of_rooms(scene) for scene in held_out},
        max(abs_rel) <= TARGET_ABS_REL,
        f"median-scaled AbsRel on the three held-out scenes, {sum(len(s.frames) for s in held_out)} frames, "
        f"is {', '.join(f'{value:.3f}' for value in abs_rel)}; the limit is {TARGET_ABS_REL:g} for each; "
        f"elsewhere {elsewhere or 'there was nothing to measure'}; the thesis's values are no baseline, "
        "because they are KITTI's, of streets up to 80 m deep",
        (*error_tables(measured), *distance_charts(measured), *pictures(measured)),
    )


def _ci95_of_rooms(scene: SceneErrors) -> tuple[float, float]:
    """Return the interval over rooms, which are resampled because views of one room are alike."""
    return bootstrap_ci95(scene.series(JUDGED, "abs_rel").reshape(-1, VIEWS_PER_ROOM).mean(axis=1))


def error_tables(measured: Sequence[SceneErrors]) -> tuple[Table, ...]:
    """Return a table for each alignment, with the thesis's Table 4.3 at the top."""
    thesis = [
        (f"thesis, scene {number}", None, None, *row, None, None, None, None)
        for number, row in enumerate(TABLE_4_3, 1)
    ]
    return tuple(
        Table(
            f"Errors of inferred depth, {alignment}",
            ("images", "frames", "farthest (m)", *HEADINGS, "AbsRel over all pixels"),
            (*thesis, *(_row(scene, alignment) for scene in measured)),
            f"{note} Means over the images; the last column counts every pixel the same. Rooms and demo "
            "scenes are judged by the truth, real frames and sets by their own depth where they have some, "
            "sets within their usual crop. The thesis does not say whether it aligned, and its metres are "
            "KITTI's: only the kind of the numbers can be compared.",
        )
        for alignment, note in NOTES.items()
    )


def _row(scene: SceneErrors, alignment: str) -> tuple[str | float, ...]:
    means = (scene.mean(alignment, measure) for measure in MEASURES)
    return scene.site.name, len(scene.frames), scene.site.cap_m, *means, scene.pooled_abs_rel(alignment)


def distance_charts(measured: Sequence[SceneErrors]) -> tuple[Chart, ...]:
    """Return charts of AbsRel over true depth, one per ``cap_m``: indoor, and outdoor if there are any."""
    return tuple(
        Chart(
            f"Error against distance, up to {cap_m:g} m",
            "true depth (m)",
            "AbsRel, median-scaled",
            tuple(_curve(group, [s for s in near if s.site.group == group]) for group in groups),
            "In each range of true depth the mean over the images that reach there, and its 95 % bootstrap "
            "interval.",
        )
        for cap_m in sorted({scene.site.cap_m for scene in measured})
        for near in [[scene for scene in measured if scene.site.cap_m == cap_m]]
        for groups in [dict.fromkeys(scene.site.group for scene in near)]
    )


def _curve(group: str, scenes: Sequence[SceneErrors]) -> Curve:
    middles_m, values = distance_curve([frame for scene in scenes for frame in scene.frames], JUDGED)
    return mean_curve(group, middles_m.tolist(), values)


def pictures(measured: Sequence[SceneErrors]) -> tuple[Picture, ...]:
    """Return the first image of every scene."""
    caption = "colour | true depth | inferred depth, median-scaled | relative error"
    return tuple(
        Picture(
            f"{scene.site.name}: AbsRel {scene.series(JUDGED, 'abs_rel')[0]:.3f}",
            ((caption, scene.strip),),
            "Both depths in the same colours, near in blue, far in red, black where unknown; the error from "
            f"black to yellow, {WORST_SHOWN:.0%} and more.",
        )
        for scene in measured
    )


def arithmetic() -> Outcome:
    """Return C13's numbers: means and both kinds of standard deviation of Table 4.3."""
    columns = np.array(TABLE_4_3)[:, [0, 2]]
    names = ("rmse_{}_m", "abs_rel_{}")
    ours = {
        name.format(what): float(value)
        for what, values in (
            ("mean", columns.mean(axis=0)),
            ("sd", columns.std(axis=0)),
            ("sample_sd", columns.std(axis=0, ddof=1)),
        )
        for name, value in zip(names, values, strict=True)
    }
    off = {name: abs(ours[name] - printed) for name, printed in PRINTED.items()}
    return Outcome(
        ours,
        {},
        max(off.values()) <= HALF_DIGIT,
        f"the printed numbers are those of the table: means {ours['rmse_mean_m']:.3f} m and "
        f"{ours['abs_rel_mean']:.3f}, population standard deviations {ours['rmse_sd_m']:.3f} m and "
        f"{ours['abs_rel_sd']:.3f}; the text calls these averages, and the sample's would be "
        f"{ours['rmse_sample_sd_m']:.3f} m and {ours['abs_rel_sample_sd']:.3f}"
        if max(off.values()) <= HALF_DIGIT
        else f"the printed numbers are up to {max(off.values()):.4f} off those of the table",
    )


def judge_against_sensor(measured: Sequence[SceneErrors]) -> Outcome:
    """Return C14's numbers and verdict, on the scenes with known truth."""
    known = [scene for scene in measured if scene.site.truth]
    names = (*ALIGNMENTS, CHAIN)
    sensor = {scene.site.name: scene.beside_sensor(SENSOR) for scene in known}
    network = {(scene.site.name, name): scene.beside_sensor(name) for scene in known for name in names}
    least = {place: min(network[place, name] for name in names) for place in sensor}
    worse = [place for place in sensor if least[place] > sensor[place]]
    unknown = [scene.site.name for scene in measured if not scene.site.truth]
    times = [least[place] / sensor[place] for place in sensor]
    ours = {f"abs_rel_sensor_{place}": value for place, value in sensor.items()}
    ours |= {f"abs_rel_network_{place}": value for place, value in least.items()}
    table = Table(
        "AbsRel of inferred depth beside the sensor's own, at the pixels where the sensor has depth",
        ("images", "sensor", *names),
        tuple((place, sensor[place], *(network[place, name] for name in names)) for place in sensor),
        "Against the truth, means over the images. The sensor is simulated: noise, steps and jitter at "
        "edges of the first Kinect. The last column is inferred depth as the chain uses it, aligned to the "
        "sensor's depth at these same pixels.",
    )
    return Outcome(
        ours,
        {},
        len(worse) == len(sensor),
        f"even in its best alignment the network errs more than the sensor in {len(worse)} of {len(sensor)} "
        f"scenes, {min(times):.1f} to {max(times):.1f} times as much"
        + (f"; the sensor's error on {', '.join(unknown)} is unknown" if unknown else ""),
        (table,),
    )


C12 = Claim(
    id="C12",
    claim="Errors of the depth network on three scenes",
    thesis="RMSE 6.328, 7.944, 5.647 m; RMSE log 0.284, 0.339, 0.236; REL 0.206, 0.361, 0.161 (KITTI)",
    tolerance=f"median-scaled AbsRel at most {TARGET_ABS_REL:g} on each of three held-out scenes; values not",
    experiment=judge_errors,
    prepare=infer_all,
)
C13 = Claim(
    id="C13",
    claim="Averages of the three scenes",
    thesis="RMSE 6.640 with 0.963, REL 0.243 with 0.086",
    tolerance="means and population standard deviations of Table 4.3 agree in every printed digit",
    experiment=arithmetic,
    by_definition=True,
)
C14 = Claim(
    id="C14",
    claim="Inferred depth is worse than direct depth",
    thesis="stated in 4.2, without a number",
    tolerance="AbsRel of the network, however aligned, above the sensor's on every scene with known truth",
    experiment=judge_against_sensor,
    prepare=infer_all,
)
CLAIMS = (C12, C13, C14)
