"""Reconstruction of one rig into a folder with a report, and of many rigs in parallel processes."""

from __future__ import annotations

import json
import shutil
import traceback
from collections.abc import Generator, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote

import cv2

from app.reports.html import picture, pictures, table, write_page
from app.reports.reconstruction import write_reconstruction_report
from app.web.markup import Markup
from packetmesh.batch import run_batch
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.files import atomic_path, finite, removed_if_empty, writable_folder, write_json
from packetmesh.progress import Progress, drain, part
from packetmesh.settings import settings
from pipeline.config import Baseline, PipelineConfig
from pipeline.folders.keyframes import iterate_keyframes
from pipeline.folders.run import (
    IMPORTED,
    METRICS,
    PICTURE,
    REPORT,
    TASK,
    check_run_folder,
    clear_run_folder,
    is_imported,
    metrics_of,
    write_baseline,
    write_run_folder,
)
from pipeline.importing import ImportReport, is_recording
from pipeline.io.rigs import is_rig
from pipeline.placement.outcome import APART
from pipeline.reconstruct import Reconstruction, iterate_reconstruction
from pipeline.recording.checkpoint import deleted_after, files_digest
from pipeline.recording.imported import iterate_checked_import
from pipeline.recording.walk import LEAST_FRAMES
from pipeline.sources import Calibrated, FileSource, Recorded, RigFolder
from pipeline.spec import Spec, whole_s
from pipeline.stages import RunCache, cameras_of, compute, dressed, run
from pipeline.surface.pictures import mesh_picture

PICTURE_WIDTH_PX = 360
State = Literal["done", "kept", "failed"]


@dataclass(frozen=True, slots=True)
class RigTask:
    """One rig or recording of many, and the folder of its run."""

    name: str
    path: str
    out: str
    preset: str
    config: PipelineConfig
    depth_scale: float | None
    """Depth units per metre; None takes those of the images or the kind of recording."""


@dataclass(frozen=True, slots=True)
class RigOutcome:
    """Result of one task. Shares are from 0 to 1; a share or time is NaN if the task failed or has none."""

    name: str
    state: State
    """``kept``: the folder has a complete earlier run of the same files with the same settings."""
    sentence: str
    """The error, or notes on the import, nodes without a place and doubtful images; empty without any."""
    nodes: int = 0
    no_hit_before: float = float("nan")
    no_hit_after: float = float("nan")
    within_2pct_before: float = float("nan")
    within_2pct_after: float = float("nan")
    agreement: float = float("nan")
    elapsed_s: float = float("nan")


def iterate_run(
    source: FileSource, preset: str, config: PipelineConfig, out: Path, baseline: Baseline | None = None
) -> Generator[Progress, None, tuple[Reconstruction, dict[str, Any]]]:
    """Reconstruct and write a run folder with its report; unusable images leave no folder.

    A recording that is given as a rig is first imported to ``out/imported``. With a baseline, its surface is
    written, too.

    Returns:
        The reconstruction and its metrics, with the import report.

    Raises:
        PacketMeshError: images, settings or a folder that cannot be used.
    """
    check_run_folder(out, source)
    rig, report = yield from iterate_imported(source, out)
    spec, cache = Spec(rig, preset, config), RunCache()
    loading = run(spec, cache, ["rig"])
    loaded = (yield from loading) if isinstance(rig, Recorded) else drain(loading)
    walk = loaded["rig"].value.walk
    with removed_if_empty(out), deleted_after(None if walk is None else walk.state):
        writable_folder(out)
        return (yield from _iterate_written(spec, cache, report, out, baseline))


def _iterate_written(
    spec: Spec, cache: RunCache, report: ImportReport | None, out: Path, baseline: Baseline | None
) -> Generator[Progress, None, tuple[Reconstruction, dict[str, Any]]]:
    """Reconstruct a rig that is loaded, and write the run folder with its report."""
    rig = spec.source
    result = yield from iterate_reconstruction(spec, cache)
    other = None
    if baseline is not None:
        other = (yield from part(compute(spec, baseline, cache), f"baseline {baseline}", 0.9, 0.92)).value
    metrics = metrics_of(result) | ({} if report is None else {"import": asdict(report)})
    clear_run_folder(out)
    try:
        if isinstance(rig, Recorded) and result.rig.walk is not None:
            recording = yield from part(rig.iterate_open(), "files", 0.92, 0.94, detail=True)
            yield from part(iterate_keyframes(recording, result.rig.walk, out), "keyframes", 0.94, 0.97)
        yield Progress("writing the report", 0.97)
        texture = dressed(result.rig, result.placement, result.after)
        write_reconstruction_report(result, metrics, out / REPORT, texture)
        if baseline is not None and other is not None:
            write_baseline(baseline, other, result, out)
        yield Progress("writing the surfaces", 0.99)
        write_run_folder(result, metrics, out, texture=texture)
    except BaseException:  # a disk that is full, or Ctrl-C
        _delete_written(out, baseline)
        raise
    return result, metrics


def _delete_written(out: Path, baseline: Baseline | None) -> None:
    """Delete the files of a run that failed while they were written."""
    with suppress(InputError, OSError):
        clear_run_folder(out)
        (out / REPORT).unlink(missing_ok=True)
        for suffix in () if baseline is None else (".ply", ".glb"):
            (out / f"surface_{baseline}{suffix}").unlink(missing_ok=True)


def iterate_imported(
    source: FileSource, out: Path
) -> Generator[Progress, None, tuple[FileSource, ImportReport | None]]:
    """Import a recording that is given as a rig to ``out/imported``; return any other source unchanged.

    Returns:
        The source to reconstruct, and the import report; None if nothing was imported.

    Raises:
        PacketMeshError: a recording or a folder that cannot be used.
    """
    if isinstance(source, Calibrated):
        inner, report = yield from iterate_imported(source.source, out)
        assert not isinstance(inner, Calibrated | Recorded)
        return replace(source, source=inner), report
    if not (isinstance(source, RigFolder) and is_imported(source)):
        return source, None
    rig, new = out / IMPORTED, not out.exists()
    if rig.is_dir():
        shutil.rmtree(rig)  # from an earlier run
    try:
        steps = iterate_checked_import(source.path, rig, depth_scale=source.depth_scale)
        report = yield from part(steps, f"import of {source.path}", 0.0, 0.05, detail=True)
    except PacketMeshError:
        if new:
            shutil.rmtree(out, ignore_errors=True)
        raise
    return RigFolder(str(rig)), report


def rigs_in(folder: Path) -> list[Path]:
    """Return the rigs and recordings directly in a folder, sorted by name.

    Raises:
        InputError: there is no such folder, or it holds no rig or recording.
    """
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder; give one that holds rigs or recordings")
    found = [path for path in sorted(folder.iterdir()) if is_rig(path) or is_recording(path)]
    if not found:
        raise InputError(
            f"{folder} holds no rig (a folder with node_00/...) and no recording that `packetmesh import` "
            "can read; give the folder that contains them"
        )
    return found


def iterate_rigs(
    tasks: list[RigTask], out: Path, scheduler: str | None
) -> Generator[Progress, None, tuple[RigOutcome, ...]]:
    """Reconstruct all tasks, on every core or on a Dask cluster that sees the same folders.

    When a task fails, its outcome holds the error, and the others continue. Even if an error or Ctrl-C stops
    the batch, ``out`` gets a table of the outcomes so far.

    Returns:
        The outcomes in the order of the tasks.

    Raises:
        PacketMeshError: the cluster cannot be reached or was lost.
    """
    outcomes: dict[int, RigOutcome] = {}
    try:
        for index, outcome in run_batch(reconstruct_one, tasks, scheduler, killed=_stopped_outcome):
            outcomes[index] = outcome
            summary = outcome.sentence or f"{outcome.no_hit_after:.1%} of the rays are without a surface"
            yield Progress(f"{outcome.name} {outcome.state}: {summary}", len(outcomes) / len(tasks))
    except BaseException as error:
        error.add_note("the same command goes on with the rigs that are left")
        raise
    finally:
        done = tuple(outcomes[index] for index in sorted(outcomes))
        if done:
            write_rigs_table(done, out)
    return done


def _stopped_outcome(task: RigTask) -> RigOutcome:
    sentence = "It was stopped, probably for lack of memory; try a smaller surface.max_points"
    return RigOutcome(task.name, "failed", sentence)


def reconstruct_one(task: RigTask) -> RigOutcome:
    """Do one task, unless its folder has a complete run of the same inputs; errors are returned, not raised.

    The traceback of an error of the program itself is written to ``NAME.log`` next to the run's folder.
    """
    out = Path(task.out)
    log = out.with_name(f"{out.name}.log")
    log.unlink(missing_ok=True)
    try:
        record = _inputs_of(task)
        kept = _kept_outcome(task, record)
        if kept is not None:
            return kept
        (out / TASK).unlink(missing_ok=True)
        result, metrics = drain(iterate_run(_source_of(task), task.preset, task.config, out))
        _write_picture(result, out)
        write_json(out / TASK, record)
        return _outcome(task, "done", finite(metrics))
    except PacketMeshError as error:
        return RigOutcome(task.name, "failed", str(error))
    except OSError as error:
        return RigOutcome(task.name, "failed", f"{error.filename or task.path}: {error.strerror or error}")
    except MemoryError:
        return _stopped_outcome(task)
    except Exception as error:  # one rig must not stop the others
        with suppress(OSError):
            log.write_text(traceback.format_exc(), encoding="utf-8")
        sentence = f"An error of the program, {type(error).__name__}: {error}; see {log.name}"
        return RigOutcome(task.name, "failed", " ".join(sentence.split()))


def _source_of(task: RigTask) -> FileSource:
    """Return the source of a task: a rig, or a recording. A recording of a single frame counts as a rig.

    Raises:
        InputError: a recording that cannot be used.
    """
    path, recorded = Path(task.path), Recorded(task.path, task.depth_scale)
    if is_recording(path) and not is_rig(path) and len(recorded.open().times_s) >= LEAST_FRAMES:
        return recorded
    return RigFolder(task.path, task.depth_scale)


def _inputs_of(task: RigTask) -> dict[str, Any]:
    """Return the inputs of a run. They are written as the run's last file, which marks it as complete."""
    return {
        "path": task.path,
        "files": files_digest(Path(task.path)),
        "depth_scale": task.depth_scale,
        "settings": settings(task.config),
    }


def _kept_outcome(task: RigTask, record: dict[str, Any]) -> RigOutcome | None:
    """Return the outcome of an earlier run with the same inputs; None if there is no complete one."""
    try:
        written = json.loads((Path(task.out) / TASK).read_text(encoding="utf-8"))
        if written != json.loads(json.dumps(record)):
            return None
        return _outcome(task, "kept", json.loads((Path(task.out) / METRICS).read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def _outcome(task: RigTask, state: State, metrics: dict[str, Any]) -> RigOutcome:
    """Return the outcome of a run from its metrics: failed if it has several nodes and no two agree."""
    before, after, measured = metrics["surface_before"], metrics["surface_after"], metrics["measured"]
    numbers = (
        before["no_hit_ray_share"],
        after["no_hit_ray_share"],
        measured["within_2pct_before"],
        measured["within_2pct_after"],
        measured["agreement_between_nodes"],
        whole_s(metrics["timings_s"]),
    )
    sentences = [*metrics.get("import", {"notes": ()})["notes"]]
    for node in metrics["nodes"]:
        sentences += [node["place"]["sentence"], *(f"{node['name']}: {note}" for note in node["notes"])]
    notes = "; ".join(filter(None, sentences))
    nodes = len(metrics["nodes"])
    if nodes > 1 and not metrics["agreement"]:
        return RigOutcome(task.name, "failed", "; ".join(filter(None, [notes, APART])), nodes)
    known = (float("nan") if number is None else float(number) for number in numbers)
    return RigOutcome(task.name, state, notes, nodes, *known)


def _write_picture(result: Reconstruction, out: Path) -> None:
    """Write a small picture of the surface as the first camera sees it."""
    rgb = mesh_picture(result.after, cameras_of(result.rig, result.placement)[0])
    height_px = round(rgb.shape[0] * PICTURE_WIDTH_PX / rgb.shape[1])
    small = cv2.resize(rgb, (PICTURE_WIDTH_PX, height_px), interpolation=cv2.INTER_AREA)
    with atomic_path(out / PICTURE) as temporary:
        Path(temporary).write_bytes(cv2.imencode(".jpg", small[..., ::-1])[1].tobytes())


def write_rigs_table(outcomes: tuple[RigOutcome, ...], out: Path) -> None:
    """Write ``rigs.json``, ``rigs.csv`` and ``rigs.html`` with a picture per rig that links to its report."""
    rows = [asdict(outcome) for outcome in outcomes]
    write_json(out / "rigs.json", finite(rows))
    lines = [",".join(rows[0]), *(",".join(_cell(value) for value in row.values()) for row in rows)]
    with atomic_path(out / "rigs.csv") as temporary:
        Path(temporary).write_text("\n".join(lines) + "\n", encoding="utf-8")
    write_page(out / "rigs.html", "PacketMesh: many rigs", Markup("").join(_page(outcomes, out)))


def _cell(value: str | float) -> str:
    """Return a value as a CSV cell."""
    return '"' + value.replace('"', '""') + '"' if isinstance(value, str) else str(value)


def _page(outcomes: tuple[RigOutcome, ...], out: Path) -> Iterator[Markup]:
    failed = sum(outcome.state == "failed" for outcome in outcomes)
    yield Markup("<h1>{} rigs</h1>").format(len(outcomes))
    yield Markup('<p class="lead">{} reconstructed, {} failed.</p>').format(len(outcomes) - failed, failed)
    yield table((*HEADINGS[:-1], "state"), [(*rigs_row(outcome)[:-1], outcome.state) for outcome in outcomes])
    items = [Markup("<li><b>{}</b>: {}</li>").format(o.name, o.sentence) for o in outcomes if o.sentence]
    if items:
        yield Markup("<h2>Notes</h2><ul>{}</ul>").format(Markup("").join(items))
    yield Markup("<h2>The surfaces as the first camera of each rig sees them</h2>")
    yield Markup('<p class="note">Magenta: the camera\'s ray meets no surface. A click opens the report.</p>')
    yield pictures(_figures(outcomes, out), 3)


def _figures(outcomes: tuple[RigOutcome, ...], out: Path) -> Iterator[Markup]:
    for outcome in outcomes:
        image = cv2.imread(str(out / outcome.name / PICTURE)) if outcome.state != "failed" else None
        if image is not None:
            yield Markup('<a href="{}/{}">{}</a>').format(
                quote(outcome.name), REPORT, picture(image[..., ::-1], outcome.name)
            )


HEADINGS = (
    "rig",
    "nodes",
    "rays without a surface before",
    "after",
    "within 2 % before",
    "after",
    "agreement",
    "s",
    "",
)


def rigs_row(outcome: RigOutcome) -> tuple[str, ...]:
    """Return one line of the table as text."""
    shares = (
        outcome.no_hit_before,
        outcome.no_hit_after,
        outcome.within_2pct_before,
        outcome.within_2pct_after,
        outcome.agreement,
    )
    numbers = [f"{share:.1%}" if share == share else "–" for share in shares]
    seconds = f"{outcome.elapsed_s:.1f}" if outcome.elapsed_s == outcome.elapsed_s else "–"
    state_text = "; ".join(text for text in (outcome.state, outcome.sentence) if text)
    return outcome.name, str(outcome.nodes or "–"), *numbers, seconds, state_text
