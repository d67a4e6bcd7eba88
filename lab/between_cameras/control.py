"""The control, random tiles left out; and a remedy: the base layers take part in the last registration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lab.between_cameras.trials import (
    METHODS,
    VALUES,
    Masks,
    Row,
    Task,
    believed_poses,
    camera_error_m,
    frames_sent,
    meshes,
    ours,
    rig_named,
    saved,
    yardstick,
)
from packetmesh.progress import drain
from pipeline.delivery.tiled import TILE
from pipeline.placement.outcome import Placement
from pipeline.sources import LoadedRig
from pipeline.spec import NEEDS, Spec
from pipeline.stages import STAGES, RunCache, compared, compute
from pipeline.types import DepthMap, RgbdFrame, Rig

RANDOM = "random tiles, as many as ours"
REMEDIED = ("ours", "RPRR, others' base layers")
"""Methods whose chain is also run with the base layers in the registration."""


def control(task: Task) -> list[Row]:
    """Return the row of random tiles for one rig, and rows with the remedy."""
    rig, poses = rig_named(task.rig), believed_poses(rig_named(task.rig), task.poses)
    masks = _random_tiles(rig, ours().masks(rig, poses))
    row: Row = {"rig": task.rig, "poses": task.poses, "method": RANDOM}
    sent = frames_sent(rig, masks)
    rows = [row | saved(task.rig, masks) | meshes(rig, sent, poses, ("placed", "chain"))]
    for name in REMEDIED:
        masks = METHODS[name].masks(rig, poses)
        row = {"rig": task.rig, "poses": task.poses, "method": f"{name}, registered with the base layers"}
        row["told_bytes"] = float(METHODS[name].received_bytes(task.rig, masks))
        rows.append(row | saved(task.rig, masks) | _remedied(rig, frames_sent(rig, masks)))
    return rows


def _random_tiles(rig: Rig, masks: Masks) -> Masks:
    """Return as many tiles of each camera, drawn among those that hold measured depth."""
    rng = np.random.default_rng(0)
    drawn = []
    for mask, frame in zip(masks, rig.frames, strict=True):
        rows, columns = mask.shape
        height, width = frame.depth.z_m.shape
        measured = np.zeros((TILE * rows, TILE * columns), np.bool_)
        measured[:height, :width] = frame.depth.valid
        filled = np.flatnonzero(measured.reshape(rows, TILE, columns, TILE).any(axis=(1, 3)))
        random = np.zeros(mask.size, np.bool_)
        random[rng.choice(filled, int(mask.sum()), replace=False)] = True
        drawn.append(random.reshape(mask.shape))
    return tuple(drawn)


def _remedied(rig: Rig, sent: Sequence[RgbdFrame]) -> Row:
    """Return measures of the chain whose registration also uses the coarse depth of left-out tiles."""
    whole = [replace(frame, depth=_with_coarse(frame)) for frame in sent]
    placement: Placement = drain(compute(_spec(rig, whole), "placement", RunCache())).value
    spec = _spec(rig, sent)
    nodes = drain(compute(spec, "nodes", RunCache())).value
    arrived = Rig(rig.name, tuple(sent))
    fused = drain(STAGES["fused"](*NEEDS["fused"].settings(spec), arrived, nodes, placement))
    after = drain(STAGES["after"](*NEEDS["after"].settings(spec), arrived, placement, fused))
    truth = compared(rig, placement, after, yardstick(rig.name)) or {}
    found: Row = {f"chain_{value}": truth.get(value, 0.0) for value in VALUES}
    return found | {"camera_error_m": camera_error_m(rig, placement.T_world_camera)}


def _with_coarse(frame: RgbdFrame) -> DepthMap:
    if frame.coarse is None:
        return frame.depth
    return DepthMap(np.where(frame.depth.valid, frame.depth.z_m, frame.coarse.z_m))


def _spec(rig: Rig, frames: Sequence[RgbdFrame]) -> Spec:
    return Spec(LoadedRig(Rig(rig.name, tuple(frames))))
