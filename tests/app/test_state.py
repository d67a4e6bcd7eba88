"""What is stale, what is recomputed, and the command that computes the same."""

from dataclasses import replace
from pathlib import Path

import pytest
import tyro

from app import cli
from app.controls import put
from app.state import CHAIN, Results, Source, Spec
from packetmesh.settings import with_settings
from pipeline.config import PRESETS, load_config

SPEC = Spec(Source(scene="office"))


def edited(path, value):
    return replace(SPEC, config=put(SPEC.config, path, value))


@pytest.mark.parametrize(
    ("spec", "first"),
    [
        (replace(SPEC, source=Source(scene="workshop")), "scene"),
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
    assert results.status("depth", SPEC, None) == "failed"
    assert results.status("fuse", SPEC, None) == "missing"
    assert results.first_stale(edited("depth.crop", True)) == "depth"
    results.retry_failed()
    assert results.first_stale(SPEC) == "depth"


SPECS = {
    "default": SPEC,
    "thesis": SPEC.with_preset("thesis"),
    "edited": edited("surface.radii_m", (0.0125, 0.02)),
    "edited twice": replace(
        edited("depth.alignment", "affine_inverse"),
        source=Source(rig="/data/my rig; with $odd names"),
    ),
    "pair": Spec(Source(color="a b.png", depth="d.png", intrinsics="k.json", depth_scale=5000.0)),
}


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
        depth_scale: float = 1000.0,
        preset: cli.PresetName = "packetmesh",
        set: cli.Settings = (),
    ) -> None:
        seen.update(locals())

    words = shlex.split(spec.command())
    assert words[:2] == ["packetmesh", "reconstruct"]
    tyro.cli(reconstruct, args=words[2:])
    assert with_settings(load_config(seen["preset"]), seen["set"]) == spec.config
    for name in ("scene", "rig", "color", "depth", "intrinsics", "depth_scale"):
        value, wanted = seen[name], getattr(spec.source, name)
        assert (str(value) if isinstance(value, Path) else value) == wanted


def test_presets_are_the_pipelines():
    assert SPEC.with_preset("thesis").config == PRESETS["thesis"]
