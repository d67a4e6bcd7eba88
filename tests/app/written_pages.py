"""Every page that the program writes, made of texts that would like to be scripts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.cli.runs import RigOutcome, write_rigs_table
from app.drawing.glb import mesh_glb
from app.drawing.legend import Legend
from app.reports.calibration import write_calibration_report
from app.reports.delivery import delivery_page
from app.reports.hand_out import viewpoint_of
from app.reports.race import RaceRun, RaceShow, race_page
from app.reports.reconstruction import write_reconstruction_report
from app.reports.reproduction import write_reproduction_report
from app.reports.surface_page import Side, SurfacePage, surface_page
from app.web.markup import plain_text
from lab.claims.claim import Verdict
from lab.claims.exhibits import Chart, Curve, HeatMap, Picture, Table
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.calibration.assess import assess
from pipeline.calibration.board import Board
from pipeline.calibration.detection import Detection
from pipeline.calibration.estimate import calibrate, held_out
from pipeline.calibration.from_images import CameraReport
from pipeline.calibration.outliers import OutlierView
from pipeline.config import PRESETS
from pipeline.folders.run import metrics_of
from pipeline.io.demos import load_demo
from pipeline.reconstruct import iterate_reconstruction
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import dressed
from pipeline.types import Rig
from tests.app.hand_outs import frames, hand_out, wall
from tests.pipeline.calibration.test_trust import BOARD, SIZE, views

EVIL = """<img src=x onerror="parent.pwned=1"><script>parent.pwned=1</script>'--></script>{0}&lt;"""
PICTURE = np.full((6, 8, 3), 90, np.uint8)


def reconstruction(folder: Path) -> str:
    frame = replace(load_demo("box-on-table").frames[0], name=EVIL, notes=(EVIL,))
    config = with_settings(PRESETS["packetmesh"], ["surface.max_points=3000"])
    result = drain(iterate_reconstruction(Spec(LoadedRig(Rig(EVIL, (frame,))), config=config)))
    node = {"source": EVIL, "target": EVIL, "method": EVIL, "iterations": 3, "stop_reason": EVIL}
    numbers = {"rmse_m": 0.01, "loop_error_m": 0.01, "within_2pct_share": 0.5, "used": True}
    metrics = metrics_of(result) | {"scene": EVIL, "preset": EVIL, "registration": [node | numbers]}
    metrics["import"] = {"notes": [EVIL]}
    metrics["nodes"][0]["place"]["sentence"] = EVIL
    texture = dressed(result.rig, result.placement, result.after)
    write_reconstruction_report(result, metrics, folder / "page.html", texture)
    return (folder / "page.html").read_text(encoding="utf-8")


def calibration(folder: Path) -> str:
    given = [replace(view, name=f"{EVIL}{view.name}") for view in views(0.2, 0)]
    found = calibrate(given, SIZE)
    trust = assess(found, given, BOARD, 2.0, 0.005)
    trust = replace(
        trust,
        outliers=(OutlierView(given[0].name, 2.0, 0.2, 0.2, 1.0),),
        verdict=replace(trust.verdict, sentence=EVIL),
    )
    unseen = Detection(np.zeros((0, 2)), np.zeros(0, int), reason=EVIL)
    seen = held_out(given, SIZE, 2)
    report = CameraReport(Board("circles", 7, 5, 0.05), {EVIL: unseen}, tuple(given), found, tuple(seen))
    write_calibration_report(report, trust, folder / "page.html")
    return (folder / "page.html").read_text(encoding="utf-8")


def reproduction(folder: Path) -> str:
    curve = Curve(EVIL, (0.0, 1.0, 2.0), (4.0, 2.0, 1.0), (3.0, 1.5, 0.5), (5.0, 2.5, 1.5))
    exhibits = (
        Table(EVIL, (EVIL, EVIL), ((EVIL, 1.0), (EVIL, EVIL)), EVIL),
        Chart(EVIL, EVIL, EVIL, (curve,), EVIL),
        HeatMap(EVIL, EVIL, (0.1, 0.6), EVIL, (5.0, 45.0), ((1.0, 0.5), (0.25, 0.0)), EVIL),
        Picture(EVIL, ((EVIL, PICTURE),), EVIL),
    )
    told = (EVIL, EVIL, EVIL, {EVIL: 0.5}, {EVIL: (0.4, 0.6)}, EVIL, EVIL)
    verdicts = [Verdict(id_, *told, exhibits) for id_ in ("C1", f"D1{EVIL}")]
    write_reproduction_report(verdicts, folder / "page.html")
    return (folder / "page.html").read_text(encoding="utf-8")


def rigs(folder: Path) -> str:
    write_rigs_table((RigOutcome(EVIL, "failed", EVIL), RigOutcome("b", "done", EVIL, 1)), folder)
    return (folder / "rigs.html").read_text(encoding="utf-8")


def delivery(folder: Path) -> str:
    on_air = replace(frames(), causes=(EVIL, EVIL, EVIL))
    given = hand_out(title=EVIL, names=(EVIL, EVIL), on_air=on_air)
    return plain_text(delivery_page(replace(given, sentence=EVIL)))


def race(folder: Path) -> str:
    rng = np.random.default_rng(0)
    cloud_m = rng.normal(0.0, 0.5, (200, 3)).astype(np.float32)
    lens = rng.integers(0, 256, (3, 20, 3), dtype=np.uint8)
    runs = tuple(
        RaceRun(
            name=EVIL,
            color=(0, 114, 178),
            poses=np.tile(np.eye(4), (3, 1, 1)),
            offs_cm=np.array([9.0, 3.0, np.nan]),
            offs=(EVIL, EVIL, EVIL),
            notes=(EVIL, EVIL, EVIL),
            arrived=True,
            shades=rng.integers(0, 256, (3, 200), dtype=np.uint8),
            lens=tuple(lens),
        )
        for _ in range(2)
    )
    view = viewpoint_of([np.eye(4)], cloud_m + np.array([0.0, 0.0, 2.0]))
    scale = (EVIL, EVIL, EVIL)
    show = RaceShow(EVIL, EVIL, cloud_m, cloud_m, view, runs, lens[0][:, :2], 20.0, scale)
    return plain_text(race_page(show))


def surface(folder: Path) -> str:
    mesh = wall(12)
    glb = mesh_glb(mesh.vertices_m, mesh.triangles, mesh.colors)
    legend = Legend(text=EVIL, swatches=((EVIL, (1, 2, 3)),))
    view = viewpoint_of([np.eye(4)], mesh.vertices_m)
    sides = Side(EVIL, EVIL, glb), Side(EVIL, EVIL, b"")
    return plain_text(surface_page(SurfacePage(EVIL, EVIL, *sides, view, legend)))


PAGES: dict[str, Callable[[Path], str]] = {
    one.__name__: one for one in (reconstruction, calibration, reproduction, rigs, delivery, race, surface)
}
