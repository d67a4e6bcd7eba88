"""What the app shows, the command that it prints gives: both ways through the chain, byte for byte."""

import io
import json
import re
import shlex
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from app.cli import main
from app.compute.state import Spec
from app.compute.store import Store
from app.screens.export.job import export_job
from packetmesh.errors import PacketMeshError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.config import PRESETS
from pipeline.io.demos import SCENES, load_demo
from pipeline.io.rigs import save_rig
from pipeline.sources import Demo, ImagePair, RigFolder
from pipeline.types import DepthMap, Rig

FEW = ("surface.max_points=6000",)
MEASURED_ANEW = ("timings_s", "peak_memory_bytes")
"""Of metrics.json: the clock and the memory of the run itself."""
NODE = SCENES / "box-on-table" / "node_00"
PAIR = ImagePair(str(NODE / "color.png"), str(NODE / "depth.png"), str(NODE / "intrinsics.json"))


def spec(source, preset="packetmesh", *settings):
    return Spec(source, preset, with_settings(PRESETS[preset], (*FEW, *settings)))


def one_ball(radius_m):
    return "surface.radius_rule=manual", f"surface.radii_m={radius_m}"


def blind(folder):
    """A rig of one node whose sensor has measured nothing."""
    (frame, *_) = load_demo("box-on-table").frames
    nothing = DepthMap(np.full_like(frame.depth.z_m, np.nan))
    save_rig(folder / "blind", Rig("blind", (replace(frame, depth=nothing),)))
    return RigFolder(str(folder / "blind"))


GOOD = {
    "rig with truth": lambda: spec(Demo("box-on-table")),
    "thesis": lambda: spec(PAIR, "thesis"),
    "with a baseline": lambda: replace(spec(PAIR), shown="poisson"),
    "one radius": lambda: spec(PAIR, "packetmesh", *one_ball(0.03)),
    "ball falls through": lambda: spec(Demo("box-on-table"), "packetmesh", *one_ball(0.0001)),
}
BAD = {
    "nothing measured": lambda folder: spec(blind(folder)),
    "no such scene": lambda folder: spec(Demo("moon")),
    "no such file": lambda folder: spec(replace(PAIR, color="/no/such/color.png")),
    "wrong units": lambda folder: spec(replace(PAIR, depth_scale=0.001)),
}


def by_the_app(spec, folder):
    """The files of the app's run folder, or the sentence that it shows."""
    store = Store(str(folder))
    try:
        drain(store.stage(spec, "after"))  # the screens ask for parts of the chain before anybody exports
        content = drain(export_job(store, spec, "run.zip", spec.shown))
    except PacketMeshError as error:
        return str(error)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name.removeprefix("run/"): archive.read(name) for name in archive.namelist()}


def by_the_command(spec, out, capsys):
    """The files of the command that the app prints, or the sentence that it ends with."""
    words = shlex.split(spec.command(str(out)))
    assert words.pop(0) == "packetmesh"
    capsys.readouterr()
    try:
        main(words)
    except SystemExit:
        return capsys.readouterr().err.splitlines()[-1].removeprefix("packetmesh: ")
    return {path.name: path.read_bytes() for path in sorted(out.iterdir())}


def without_the_clock(files):
    """The files with what a run measures of itself taken out; the names of the stages stay."""
    metrics = json.loads(files["metrics.json"])
    stages = list(metrics["timings_s"])
    for key in MEASURED_ANEW:
        del metrics[key]
    report = files["report.html"].decode()
    begin, end = report.index("<h2>Time and settings</h2>"), report.index("All settings are in")
    report = report[:begin] + re.sub(r"[\d.,]+", "#", report[begin:end]) + report[end:]
    rest = {name: content for name, content in files.items() if name not in ("metrics.json", "report.html")}
    return rest | {"metrics.json": metrics, "report.html": report, "stages": stages}


def both_ways(asked, folder, capsys):
    """What the app gives, and what its command gives."""
    (folder / "store").mkdir()
    return by_the_app(asked, folder / "store"), by_the_command(asked, folder / "out", capsys)


@pytest.mark.parametrize("name", GOOD)
def test_the_app_and_the_command_line_give_the_same_bytes(name, tmp_path, capsys):
    shown, given = both_ways(GOOD[name](), tmp_path, capsys)
    assert sorted(given) == sorted(shown)
    for file, content in without_the_clock(shown).items():
        assert without_the_clock(given)[file] == content, file
    falls = json.loads(shown["metrics.json"])["surface_after"]["no_hit_ray_share"] == 1.0
    assert falls == (name == "ball falls through") == ("surface.glb" not in shown)


@pytest.mark.parametrize("name", BAD)
def test_the_app_and_the_command_line_refuse_in_the_same_words(name, tmp_path, capsys):
    shown, given = both_ways(BAD[name](tmp_path), tmp_path, capsys)
    assert given == shown
    assert "\n" not in shown
    assert not (tmp_path / "out" / "metrics.json").exists()


@pytest.mark.parametrize("shown", ["after", "before", "poisson"])
def test_the_surface_that_is_shown_is_the_one_that_is_saved(shown, tmp_path):
    store, asked = Store(str(tmp_path)), spec(PAIR)
    surface = drain(store.stage(asked, shown))
    saved = drain(export_job(store, asked, "surface.ply", shown))
    count = int(re.search(rb"element face (\d+)", saved)[1])
    assert count == len(surface.triangles) > 100
