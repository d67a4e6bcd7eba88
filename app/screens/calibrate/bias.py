"""The bias of a camera's depth, from the depth images beside the photographs of the board."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

from app.compute.state import BoardViews
from app.compute.store import Store
from app.drawing.depth_bias_plots import bias_curve
from app.screens.calibrate.cameras import CamerasFound, own_views, stage_name
from app.screens.calibrate.request import shots_of
from app.screens.calibrate.view import BiasView
from packetmesh.progress import Progress
from pipeline.calibration.depth_bias import DepthFit
from pipeline.calibration.rig_from_images import node_with_depth
from pipeline.calibration.shots import INFRARED, NodeShots
from pipeline.io.depth_correction import DepthCorrection

UNITS = {
    "offset_m": ("Offset", 1000.0, "mm"),
    "scale": ("Scale", 100.0, "%"),
    "curvature_per_m": ("Curvature", 1000.0, "mm at 1 m"),
}
"""What the terms are called, and units shown in one of the field's."""


@dataclass(frozen=True, slots=True)
class DepthFound:
    """A correction, and what the panel shows of it."""

    correction: DepthCorrection
    view: BiasView


def bias_of(
    store: Store, views: BoardViews, cameras: CamerasFound, camera: str, done: float = 0.5
) -> Generator[Progress, None, DepthFound | str]:
    """The bias of the depth of a camera's node, or why it is not known.

    Args:
        store: what is known already: a camera by itself keeps its bias while only others change.
        views: the photographs.
        cameras: that took them.
        camera: one of them.
        done: share of the work before this.
    """
    name = camera.removesuffix(INFRARED)

    def compute() -> Generator[Progress, None, DepthFound | str]:
        yield Progress(f"depth of {name} against the board", done)
        return _bias(_node(views, name), cameras)

    together = cameras.rig is not None
    depends_on = views if together else own_views(views, name, name + INFRARED)
    return (yield from store.remember((stage_name("bias", name), together, depends_on), compute))


def depth_file(views: BoardViews, camera: str, moment: str) -> Path | None:
    """The depth image of a view, on the pixels of its photograph; None without one."""
    apart = camera.endswith(INFRARED)
    shots = _node(views, camera.removesuffix(INFRARED)).shots
    found = (one.depth for one in shots if one.moment == moment and (one.infrared is not None) == apart)
    return next(found, None)


def _node(views: BoardViews, name: str) -> NodeShots:
    (node,) = (one for one in shots_of(views) if one.name == name)
    return node


def _bias(node: NodeShots, cameras: CamerasFound) -> DepthFound | str:
    if node.name not in cameras.reports:
        camera = cameras.view.camera(node.name)
        reason = "" if camera is None else camera.reason
        return f"{node.name} has no lens yet, and depth is judged through it; {reason}"
    report = node_with_depth(node, cameras.reports)
    if report.depth is not None:
        note = " ".join((*report.depth_notes, report.depth.note)).strip()
        return DepthFound(report.depth.correction, _view(report.depth, note))
    return report.depth_reason or (
        f"There are no depth images beside the photographs of {node.name}; add depth_00.png beside "
        "color_00.png and so on"
    )


def _view(fit: DepthFit, note: str) -> BiasView:
    """What the panel shows of it."""
    rows = _rows(fit.correction)
    return BiasView(fit.terms, rows, fit.rms_before_m, fit.rms_after_m, bias_curve(fit), note)


def _rows(correction: DepthCorrection) -> tuple[tuple[str, float, float, float, str], ...]:
    rows = []
    for name, (title, times, unit) in UNITS.items():
        if name in correction.ci95:
            low, high = (times * float(end) for end in correction.ci95[name])
            value = times * float(getattr(correction, name))
            start = 100.0 if name == "scale" else 0.0
            rows.append((title, value - start, low - start, high - start, unit))
    return tuple(rows)
