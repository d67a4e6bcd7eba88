"""Output folder of a plan: its record, report and floor plan; and the plan in sentences."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from packetmesh.errors import InputError
from packetmesh.files import delete_unfinished, file_trouble
from packetmesh.settings import settings
from pipeline.folders.inputs import check_inputs_stay
from pipeline.folders.run import IMPORTED, check_no_images, is_imported
from pipeline.kernels.geometry import aim_deg
from pipeline.planning.calls import RigPlan
from pipeline.planning.places import floor_m
from pipeline.planning.promise import Promise
from pipeline.planning.radio import ruled_out
from pipeline.sources import FileSource
from pipeline.spec import Spec

RECORD, PAGE, DRAWING, PRINT = "plan.json", "plan.html", "floor_plan.svg", "floor_plan.pdf"
FILES = (RECORD, PAGE, DRAWING, PRINT)
"""All files of a plan; the record is deleted first and written last."""
LEAST_NAMED = 0.0005
"""Least share of the rays on dark surface that a sentence names: a tenth of a point, rounded."""
MOSTLY = 0.5
"""Share of a promise that is most of it."""


def check_plan_folder(folder: Path, source: FileSource) -> None:
    """Check that a plan in a folder would replace no images.

    Raises:
        InputError: the folder is a rig or a recording, or a file of the source would be replaced.
    """
    check_no_images(folder)
    replaced = (*FILES, *([IMPORTED] if is_imported(source) else []))
    check_inputs_stay([folder / name for name in replaced], source.paths)


def clear_plan_folder(folder: Path) -> None:
    """Delete the files of an earlier plan, complete or interrupted; a run of ``reconstruct`` there stays.

    Raises:
        InputError: the folder cannot be written.
    """
    try:
        for name in FILES:
            (folder / name).unlink(missing_ok=True)
        delete_unfinished(folder)
    except OSError as error:
        raise InputError(file_trouble(error)) from None


def plan_record(planned: RigPlan, scene: str, preset: str) -> dict[str, Any]:
    """Return the record of a plan: metres, seconds, joules, shares from 0 to 1; infinite means never.

    Args:
        planned: the plan.
        scene: title of the images.
        preset: name of the network's preset, or of its file.
    """
    plan, delivery = planned.plan, planned.delivery
    ground_m = floor_m(planned.seen)
    cameras = []
    for camera, sent in zip(plan.cameras, delivery.cameras, strict=True):
        pan_deg, tilt_deg = aim_deg(camera.T_world_camera)
        cameras.append(
            {
                "T_world_camera": camera.T_world_camera,
                "height_m": camera.T_world_camera[2, 3] - ground_m,
                "pan_deg": pan_deg,
                "tilt_deg": tilt_deg,
                "where": camera.where,
                **_promise(camera.promise),
                "overlap": camera.overlap_share,
                "seconds_to_90": sent.seconds_to_90_s,
                "seconds_to_99": sent.seconds_to_99_s,
                "joules": sent.joules,
                "battery_days": sent.battery_days,
            }
        )
    return {
        "scene": scene,
        "sensor": plan.sensor.name,
        "where": list(plan.config.where),
        "dark_surface": plan.config.dark_surface,
        "cameras": cameras,
        "total": _promise(plan.total) | {"joules": delivery.joules},
        "measured_rays": plan.measured_share,
        "at_least_of_best": plan.at_least_of_best,
        "candidates": plan.candidates,
        "floor_m": ground_m,
        "network": {
            "preset": preset,
            "coding": planned.radio.coding,
            "walls": planned.radio.walls,
            "walls_m": delivery.walls_m,
            "sink_m": list(delivery.sink_m),
            "image_bytes": delivery.image_bytes,
            "every_s": planned.radio.every_s,
            "budget_j": planned.radio.budget_j,
            "deadline_s": planned.radio.deadline_s,
        },
    }


def _promise(one: Promise) -> dict[str, Any]:
    return {"gain_rays": one.gain_share, "ci95": list(one.ci95_share), "dark_rays": one.dark_share}


def settings_record(spec: Spec, planned: RigPlan) -> dict[str, Any]:
    """Return all settings of the reconstruction and of the network."""
    return {
        "chain": {"preset": spec.preset, "settings": settings(spec.config)},
        "network_settings": settings(planned.radio.network),
    }


def points(promise: Promise) -> str:
    """Return a promise in points of rays (hundredths of all rays) with its 95 % interval."""
    low, high = promise.ci95_share
    return f"{100.0 * promise.gain_share:.1f} ({100.0 * low:.1f} to {100.0 * high:.1f})"


def dark_points(promise: Promise) -> str:
    """Return the points of a promise that are on dark surface."""
    return f"{100.0 * promise.dark_share:.1f}"


def dark_part(promise: Promise) -> str:
    """Return the part of a sentence on how much of a promise is on dark surface; empty if nothing is."""
    if promise.dark_share < LEAST_NAMED:
        return ""
    return f", {dark_points(promise)} of them on a dark surface that may stay without depth"


def dark_sentence(planned: RigPlan) -> str:
    """Return a sentence that dark surface is left out, or a warning if most of the promise is on it."""
    plan = planned.plan
    if not plan.config.dark_surface:
        return "Surface that looks dark to a present sensor is left out of this plan"
    if plan.total.dark_share < max(LEAST_NAMED, MOSTLY * plan.total.gain_share):
        return ""
    return (
        "Most of the promise is on surface that looks dark to a present sensor: a camera of the same kind "
        "may measure nothing there; --no-dark-surface plans without it"
    )


def promise_sentence(planned: RigPlan) -> str:
    """Return a sentence on what all cameras of a plan promise together."""
    plan, count = planned.plan, len(planned.plan.cameras)
    who = "The camera promises" if count == 1 else f"The {count} cameras together promise"
    return (
        f"{who} {points(plan.total)} points{dark_part(plan.total)}: {plan.measured_share:.1%} of the "
        "present cameras' rays meet measured surface now, about "
        f"{plan.measured_share + plan.total.gain_share:.1%} would then; in brackets the 95 % interval"
    )


def best_sentence(planned: RigPlan) -> str:
    """Return a sentence on how far a plan can be from the best choice."""
    plan = planned.plan
    least = f"{plan.at_least_of_best:.0%}"
    share = "as much as" if least == "100%" else f"at least {least} of what"
    return (
        f"It promises {share} the best choice could, among the {plan.candidates} judged cameras that can be "
        f"registered{ruled_out(plan, planned.radio.deadline_s)}"
    )


def times_sentence(planned: RigPlan) -> str:
    """Return a sentence on what was sent for the times and joules, and where the sink stands."""
    delivery, radio = planned.delivery, planned.radio
    x_m, y_m = delivery.sink_m
    by = ", where its weakest link to a camera is strongest" if radio.sink_m == "best" else ""
    return (
        f"Times and joules are for one image from each present and new camera at once, coded by "
        f"{radio.coding}, to a sink at {x_m:.2f}, {y_m:.2f} (x, y in metres{by}); a new image counts as "
        f"{delivery.image_bytes:,} bytes, the present ones' mean, because its content is not known yet"
    )


def fewer_sentence(planned: RigPlan, requested: int) -> str:
    """Return a sentence that a plan has fewer cameras than ``requested``; empty if it has all."""
    found, radio = len(planned.plan.cameras), planned.radio
    if found >= requested:
        return ""
    if planned.plan.config.cameras < requested:
        return f"The budget of {radio.budget_j:g} J allows {found} of the {requested} cameras"
    return f"Only {found} of the {requested} cameras would add anything; allow more kinds of places for more"


def level_sentence(planned: RigPlan) -> str:
    """Return a sentence that the upward direction is assumed; empty if a camera has a pose."""
    if any(frame.pose_known for frame in planned.rig.frames):
        return ""
    return (
        "No camera has a pose, so the first counts as level: if it was tilted, heights, floor and walls of "
        "this plan are wrong; give poses with the third axis upwards"
    )
