"""``packetmesh reconstruct``: the whole chain from images to a surface."""

from __future__ import annotations

import sys
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.cli.options import Images, PresetName, Settings
from app.cli.text import aligned, print_json, say, say_progress, wrong_use
from packetmesh.progress import drain
from packetmesh.settings import config_named, with_settings
from pipeline.config import PRESETS, Baseline

if TYPE_CHECKING:
    from pipeline.placement.outcome import Placement


def reconstruct(
    images: Images,
    out: Path,
    rigs: Path | None = None,
    scheduler: str | None = None,
    preset: PresetName = "packetmesh",
    set: Settings = (),
    baseline: Baseline | None = None,
    json: bool = False,
) -> None:
    """Reconstruct the surface from images, before and after fusion.

    Args:
        images: Images to reconstruct.
        out: Folder for config.json, metrics.json, poses.json, the clouds, the surfaces and report.html.
        rigs: Instead of one rig: a folder of rigs and of recordings, of which all frames are used. Each gets
            its own folder in OUT, and all together a table (rigs.html, rigs.csv, rigs.json). The same command
            resumes an interrupted run.
        scheduler: Address of a Dask scheduler that runs many rigs; without it, this machine's cores do. Its
            workers must see the same folders.
        preset: Settings to start from.
        set: Settings to change, for example `--set depth.alignment=median surface.max_points=20000`.
        baseline: Also compute the surface by another method from the same points: surface_poisson.ply and
            .glb, or surface_alpha.ply and .glb.
        json: Print the metrics as one JSON object; with `--rigs`, the table as a list of objects.
    """
    if rigs is not None and baseline is not None:
        wrong_use("--baseline is for one rig: leave out --rigs")
    if rigs is not None:
        images.nothing_but_scale("--rigs")
        _many(rigs, out, images.depth_scale, scheduler, preset, set, json)
        return
    if scheduler is not None:
        wrong_use("--scheduler is for many rigs: it takes --rigs FOLDER")
    source = images.source()
    config = with_settings(config_named(preset, PRESETS), set)

    from app.cli.runs import iterate_run

    result, metrics = drain(iterate_run(source, preset, config, out, baseline), say_progress)
    before, after = metrics["surface_before"], metrics["surface_after"]
    say(
        f"100%  rays without a surface: {before['no_hit_ray_share']:.1%} before fusion, "
        f"{after['no_hit_ray_share']:.1%} after; measured pixels within 2 % of the surface: "
        f"{before['within_2pct_share']:.1%} before, {after['within_2pct_share']:.1%} after; see "
        f"{out / 'report.html'}"
    )
    for sentence in recording_sentences(metrics):
        say(sentence)
    if not after["triangles"]:
        say("The ball falls through everywhere; try larger surface.radii_m")
    for note in (*imported_notes(metrics.get("import")), *result.rig.notes):
        say(note)
    if json:
        print_json(metrics)
    say_places(result.placement, "keyframes" if "recording" in metrics else "cameras")


def recording_sentences(metrics: dict[str, Any]) -> list[str]:
    """Return sentences on how a recording was tracked; an empty list if the images are no recording."""
    if "recording" not in metrics:
        return []
    from pipeline.folders.walk import lost_sentences

    recording, per_s = metrics["recording"], f"{metrics['recording']['frames_per_s']:.2g}"
    summary = (
        f"Tracked {recording['frames']} frames over {recording['path_m']:.1f} m at "
        f"{per_s} frame{'s' * (per_s != '1')} a second; keyframes: {recording['keyframes']}, loops: "
        f"{recording['loops']}"
    )
    return [summary, *lost_sentences(recording, metrics["measured"]["agreement_between_nodes"])]


def imported_notes(report: dict[str, Any] | None) -> list[str]:
    """Return sentences on the import of a recording and its assumptions."""
    if report is None:
        return []
    count = len(report["frames"])
    taken = f"imported as {count} node{'s' * (count != 1)} of {report['candidates']} moments"
    return [f"{report['folder']} is a recording ({report['kind']}), {taken}", *report["notes"]]


def _many(
    rigs: Path,
    out: Path,
    depth_scale: float | None,
    scheduler: str | None,
    preset: str,
    set: tuple[str, ...],
    json: bool,
) -> None:
    """Reconstruct every rig of a folder; exit with 1 if one failed."""
    config = with_settings(config_named(preset, PRESETS), set)

    from dataclasses import asdict

    from app.cli.runs import HEADINGS, RigTask, iterate_rigs, rigs_in, rigs_row
    from packetmesh.files import writable_folder
    from pipeline.folders.run import check_run_folder
    from pipeline.sources import RigFolder

    tasks = [
        RigTask(path.name, str(path.resolve()), str(out.resolve() / path.name), preset, config, depth_scale)
        for path in rigs_in(rigs)
    ]
    for task in tasks:
        check_run_folder(Path(task.out), RigFolder(task.path))
    writable_folder(out)
    outcomes = drain(iterate_rigs(tasks, out, scheduler), say_progress)
    if json:
        print_json([asdict(outcome) for outcome in outcomes])
    else:
        print(aligned([HEADINGS, *map(rigs_row, outcomes)]))
    failed = sum(outcome.state == "failed" for outcome in outcomes)
    say(f"{len(outcomes) - failed} of {len(outcomes)} rigs reconstructed; see {out / 'rigs.html'}")
    if failed:
        sys.exit(1)


def say_places(placement: Placement, nodes: str = "cameras") -> None:
    """Print how far the nodes of a rig agree and which have no pose; exit with 1 if no two agree.

    ``nodes`` is what they are: cameras, or the keyframes of one.
    """
    from pipeline.placement.outcome import APART

    if len(placement.verdicts) < 2:
        return
    share = placement.agreement.within_2pct_share
    if isfinite(share):  # some two measured the same surface
        say(f"Where two {nodes} measured the same surface, {share:.1%} of the points agree within 2 %")
    for sentence in placement.sentences:
        say(sentence)
    if placement.apart:
        say(APART)
        sys.exit(1)
