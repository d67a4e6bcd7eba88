"""``packetmesh reconstruct``: the whole way from images to a surface."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.options import Images, PresetName, Settings
from app.cli.text import print_json, say, say_progress
from packetmesh.progress import drain
from packetmesh.settings import config_named, with_settings
from pipeline.config import PRESETS

if TYPE_CHECKING:
    from pipeline.placement import Placement


def reconstruct(
    images: Images,
    out: Path,
    preset: PresetName = "packetmesh",
    set: Settings = (),
    json: bool = False,
) -> None:
    """Go the whole way from images to a surface before and after fusion.

    Args:
        images: What is reconstructed.
        out: Folder for config.json, metrics.json, poses.json, the clouds, the surfaces and report.html.
        preset: Settings to start from.
        set: Settings to change, for example `--set depth.alignment=median surface.max_points=20000`.
        json: Print the metrics as one JSON object.
    """
    source = images.source()
    config = with_settings(config_named(preset, PRESETS), set)

    from app.reports.reconstruction import write_reconstruction_report
    from packetmesh.files import writable_folder
    from pipeline.reconstruct import iterate_reconstruction
    from pipeline.run_folder import metrics_of, write_run_folder
    from pipeline.spec import Spec
    from pipeline.stages import RunCache, run

    spec, cache = Spec(source, preset, config), RunCache()
    drain(run(spec, cache, ["rig"]))  # images that cannot be used leave no folder
    writable_folder(out)
    result = drain(iterate_reconstruction(spec, cache), say_progress)
    metrics = metrics_of(result)
    write_run_folder(result, metrics, out)
    write_reconstruction_report(result, metrics, out / "report.html")
    before, after = metrics["surface_before"], metrics["surface_after"]
    say(
        f"100%  rays without a surface: {before['no_hit_ray_share']:.1%} before fusion, "
        f"{after['no_hit_ray_share']:.1%} after; measured pixels within 2 % of the surface: "
        f"{before['within_2pct_share']:.1%} before, {after['within_2pct_share']:.1%} after; see "
        f"{out / 'report.html'}"
    )
    if not after["triangles"]:
        say("The ball falls through everywhere; try larger surface.radii_m")
    if json:
        print_json(metrics)
    say_places(result.placement)


def say_places(placement: Placement) -> None:
    """How far the nodes of a rig agree, and which found no place; exits with 1 if no two did."""
    if len(placement.verdicts) < 2:
        return
    if placement.agreements:
        share = placement.agreement.within_2pct_share
        say(f"Of what two cameras both measured, {share:.1%} is within 2 %")
    for sentence in placement.sentences:
        say(sentence)
    if not placement.agreements:
        say("No two nodes stand beside each other: the surface is of one node only")
        sys.exit(1)
