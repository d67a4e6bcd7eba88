"""Pose and verdict by PacketMesh for two views or two bare clouds."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lab.places.judging import PlacesTask, Verdict, judged
from lab.places.pairs import PlacesPair
from lab.places.pairs import pair as stored_pair
from packetmesh.errors import PacketMeshError
from pipeline.acquisition import back_project
from pipeline.config import RegistrationConfig
from pipeline.pairs.found import find_place, settled_answer
from pipeline.pairs.register import DEFAULT_METHOD, Pair
from pipeline.registration.colour import lifted_features
from pipeline.registration.finding.evidence import Judge
from pipeline.registration.finding.search import search
from pipeline.registration.finding.starts import by_colour, by_surfaces
from pipeline.registration.finding.surface import Surface
from pipeline.types import FloatArray, PointCloud

OURS = "packetmesh"
OURS_GEOMETRY = "packetmesh, no colour"


@dataclass(frozen=True, slots=True)
class Placed:
    """An answer on a pair."""

    T_target_source: FloatArray | None
    """(4, 4) pose; None if the search found none, and the verdict is then "none"."""
    verdict: Verdict
    elapsed_s: float
    """Time from images, or bare clouds, to the verdict."""


def solve_own(task: PlacesTask) -> dict[str, Any]:
    """Solve a pair by PacketMesh, ``OURS`` or ``OURS_GEOMETRY``; returns the row of ``judged``."""
    views = stored_pair(task.split, task.index, task.overlap)
    found = place(views, with_color=task.program == OURS)
    return judged(task, views, found.T_target_source, found.verdict, found.elapsed_s)


def place(views: PlacesPair, with_color: bool) -> Placed:
    """Find the pose of two RGB-D views; without colour only their depth is used."""
    started = time.perf_counter()
    source, target = back_project(views.source), back_project(views.target)
    starts = [by_surfaces(source, target, from_cameras=True)]
    if with_color:
        starts.insert(0, by_colour(lifted_features(views.source), lifted_features(views.target)))
    else:
        source, target = replace(source, colors=None), replace(target, colors=None)
    judge = Judge(Surface(source, from_camera=True), Surface(target, from_camera=True))
    try:
        found = search(source, target, starts, judge, RegistrationConfig())
    except PacketMeshError:
        return Placed(None, "none", time.perf_counter() - started)
    return Placed(found.candidate.T_target_source, found.verdict.word, time.perf_counter() - started)


def place_clouds(source: PointCloud, target: PointCloud) -> Placed:
    """Find the pose of two bare clouds, as ``packetmesh register --start global`` does."""
    started = time.perf_counter()
    try:
        place = find_place(Pair(source, target, np.eye(4)), RegistrationConfig(start="global"), None)
        answer = settled_answer(DEFAULT_METHOD, place)
    except PacketMeshError:
        return Placed(None, "none", time.perf_counter() - started)
    word: Verdict = "none" if answer.verdict is None else answer.verdict.word
    return Placed(answer.T_target_source, word, time.perf_counter() - started)
