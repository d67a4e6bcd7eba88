"""Jobs that export a plan: its floor plan as SVG or PDF, and its positions as JSON."""

from __future__ import annotations

import json
from collections.abc import Generator
from typing import Literal

from app.compute.state import Sent, Spec
from app.compute.store import Store
from app.reports.floor_plan import floor_plan
from app.reports.paper import pdf_of, svg_of
from app.screens.network.planning.planned import rig_plan
from app.screens.network.planning.view import PlanRequest, Poses
from packetmesh.files import finite
from packetmesh.progress import Progress
from pipeline.folders.plan import plan_record, settings_record

Content = Generator[Progress, None, bytes]


def drawing_job(
    store: Store, spec: Spec, request: PlanRequest, sent: Sent, poses: Poses, form: Literal["svg", "pdf"]
) -> Content:
    """Return the floor plan with the ghosts at these poses."""
    _, planned = yield from rig_plan(store, spec, request, poses, sent)
    yield Progress("drawing the floor plan", 0.9)
    paper = floor_plan(planned)
    return svg_of(paper).encode() if form == "svg" else pdf_of(paper)


def record_job(
    store: Store, spec: Spec, request: PlanRequest, sent: Sent, poses: Poses, preset: str
) -> Content:
    """Return the record of the plan, as ``packetmesh plan`` writes it, with the ghosts at these poses."""
    _, planned = yield from rig_plan(store, spec, request, poses, sent)
    record = plan_record(planned, spec.source.title, preset) | settings_record(spec, planned)
    return (json.dumps(finite(record), indent=1, allow_nan=False) + "\n").encode()
