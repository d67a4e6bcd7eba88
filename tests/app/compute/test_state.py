"""What is stale, what is recomputed, and the command that computes the same."""

from dataclasses import replace
from pathlib import Path

import pytest
import tyro

from app.cli import options
from app.compute.state import CHAIN, BoardViews, Results, Spec
from app.window.controls import put
from network_sim.config import NetworkConfig
from packetmesh.settings import config_named, with_settings
from pipeline.config import PRESETS
from pipeline.sources import Demo, ImagePair, RigFolder

SPEC = Spec(Demo("office"))


def edited(path, value):
    return replace(SPEC, config=put(SPEC.config, path, value))


@pytest.mark.parametrize(
    ("spec", "first"),
    [
        (replace(SPEC, source=Demo("workshop")), "scene"),
        (edited("depth.alignment", "median"), "depth"),
        (edited("acquisition.outlier_t", 2.0), "depth"),
        (edited("fusion.mode", "union"), "depth"),
        (edited("node_registration.method", "icp"), "fuse"),
        (edited("fusion.align_nodes_with", "fused"), "fuse"),
        (edited("surface.max_points", 5000), "surface"),
        (edited("inferred_registration.method", "icp"), None),
    ],
)
def test_a_change_makes_stale_what_depends_on_it_and_nothing_else(spec, first):
    results = Results()
    for step in CHAIN:
        results.put(step, SPEC.key(step), step)
    expected = CHAIN[CHAIN.index(first) :] if first else ()
    assert tuple(step for step in CHAIN if not results.fresh(step, spec)) == expected
    assert results.first_stale(spec) == first


def test_photographs_of_a_board_concern_no_step_of_the_chain_and_wait_until_somebody_looks():
    views = replace(SPEC, views=BoardViews("boards"))
    assert all(views.key(step) == SPEC.key(step) for step in CHAIN)
    assert Results().first_stale(SPEC, ("calibrate",)) is None
    assert Results().first_stale(views, ("calibrate",)) == "calibrate"
    dropped = replace(views, views=replace(views.views, dropped=(("node_00", "3"),)))
    assert dropped.key("calibrate") != views.key("calibrate")


def test_going_back_makes_fresh_again():
    results = Results()
    for step in CHAIN:
        results.put(step, SPEC.key(step), step)
    assert results.first_stale(edited("surface.max_points", 5000)) == "surface"
    assert results.first_stale(SPEC) is None


def test_a_failed_step_holds_the_chain_until_something_changes():
    results = Results()
    results.put("scene", SPEC.key("scene"), "view")
    results.fail("depth", SPEC.key("depth"), "no")
    assert results.first_stale(SPEC) is None
    assert results.status("depth", SPEC) == "failed"
    assert results.status("fuse", SPEC) == "missing"
    assert results.first_stale(edited("depth.crop", True)) == "depth"
    results.retry_failed()
    assert results.first_stale(SPEC) == "depth"


SPECS = {
    "default": SPEC,
    "thesis": SPEC.with_preset("thesis"),
    "edited": edited("surface.radii_m", (0.0125, 0.02)),
    "edited twice": replace(
        edited("depth.alignment", "affine_inverse"),
        source=RigFolder("/data/my rig; with $odd names"),
    ),
    "pair": Spec(ImagePair(color="a b.png", depth="d.png", intrinsics="k.json", depth_scale=5000.0)),
}


def wanted_options(source):
    match source:
        case Demo(name):
            return {"scene": name}
        case RigFolder(path):
            return {"rig": path}
        case ImagePair(color, depth, intrinsics, scale):
            return {"color": color, "depth": depth, "intrinsics": intrinsics, "depth_scale": scale}


@pytest.mark.parametrize("spec", SPECS.values(), ids=SPECS)
def test_the_command_parses_back_to_the_same(spec, monkeypatch):
    import shlex

    seen = {}

    def reconstruct(
        out: Path,
        scene: str | None = None,
        rig: Path | None = None,
        color: Path | None = None,
        depth: Path | None = None,
        intrinsics: Path | None = None,
        depth_scale: float | None = None,
        preset: options.PresetName = "packetmesh",
        set: options.Settings = (),
    ) -> None:
        seen.update(locals())

    words = shlex.split(spec.command())
    assert words[:2] == ["packetmesh", "reconstruct"]
    tyro.cli(reconstruct, args=words[2:])
    assert with_settings(config_named(seen["preset"], PRESETS), seen["set"]) == spec.config
    wanted = wanted_options(spec.source)
    for name in ("scene", "rig", "color", "depth", "intrinsics", "depth_scale"):
        value = seen[name]
        assert (str(value) if isinstance(value, Path) else value) == wanted.get(name)


def test_presets_are_the_pipelines():
    assert SPEC.with_preset("thesis").config == PRESETS["thesis"]


def test_what_is_shown_and_the_networks_runs_leave_the_chain_fresh():
    results = Results()
    for step in CHAIN:
        results.put(step, SPEC.key(step), step)
    other = replace(SPEC, shown="poisson", networks=(NetworkConfig(),))
    assert results.first_stale(other) is None
    assert results.first_stale(other, ("network",)) == "network"
    assert results.first_stale(SPEC, ("network",)) is None
    assert other.command() == f"{SPEC.command()} --baseline poisson"
