"""The job of the Calibrate screen: the cameras of a board session, and the bias of their depth."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.calibrate.cameras import bias_of, cameras_of
from app.screens.calibrate.view import CalibrationView
from packetmesh.progress import Progress

CAMERAS_SHARE = 0.6
"""Share of the progress for the cameras; their depth has the other part."""


def calibrate_job(store: Store, spec: Spec) -> Generator[Progress | CalibrationView, None, CalibrationView]:
    """Find the board in all photographs; estimate every camera alone, all cameras together, and the bias of
    their depth; yield partial results.
    """
    views = spec.views
    assert views is not None
    found = yield from cameras_of(store, views, CAMERAS_SHARE)
    view = found.view
    yield view
    for index, camera in enumerate(view.cameras):
        done = CAMERAS_SHARE + (1.0 - CAMERAS_SHARE) * index / len(view.cameras)
        bias = yield from bias_of(store, views, found, camera.name, done)
        view = replace(view, depth=view.depth | {camera.name: bias if isinstance(bias, str) else bias.view})
        yield view
    return view
