"""The job that makes a rig from an uploaded recording, or keeps all its frames."""

from __future__ import annotations

import shutil
from collections.abc import Generator
from pathlib import Path

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.scene.recording import ReadRecording
from app.web.zips import opened_zip
from packetmesh.errors import InputError
from packetmesh.files import path_below
from packetmesh.progress import Progress
from pipeline.importing import is_recording
from pipeline.importing.recorded import iterate_opening
from pipeline.io.rigs import is_pair, is_rig, load_rig
from pipeline.recording.imported import iterate_checked_import
from pipeline.sources import Recorded, RigFolder
from pipeline.types import Rig

UNPACKED_LIMIT_BYTES = 1 << 30
MOST_FILES = 20_000
INSTEAD = "use packetmesh import and reconstruct for larger ones"


def recording_job(
    store: Store, spec: Spec, path: Path, name: str, depth_scale: float | None, frames: int | None
) -> Generator[Progress, None, ReadRecording]:
    """Unpack a ZIP and make a source of its content, without results of the chain.

    Args:
        store: not used.
        spec: not used.
        path: a recording's file or a ZIP, in a folder of its own.
        name: name of the rig or recording, which is put next to that folder.
        depth_scale: depth units per metre; None takes the one of the images or the kind of recording.
        frames: number of frames of a recording that become nodes; None keeps the recording with all frames.

    Raises:
        InputError: a file cannot be read, is too large, or holds no recording or several.
    """
    yield Progress("reading the recording", 0.0)
    rig = path_below(path.parent.parent, name)
    if path.suffix.lower() != ".zip":
        return (yield from _used(path, rig, frames, depth_scale))
    unpacked = path.with_suffix("")
    try:
        unpack(path, unpacked / "files")
        found = _the_only(unpacked / "files")
        if is_pair(found):
            (unpacked / "rig").mkdir()
            found = found.rename(unpacked / "rig" / "node_00").parent
        if is_rig(found):
            read = load_rig(found, depth_scale=depth_scale)  # reports errors of the rig now
            found.rename(rig)
            return ReadRecording(RigFolder(str(rig), depth_scale), (_rig_note(read),))
        return (yield from _used(found, rig, frames, depth_scale))
    finally:
        shutil.rmtree(unpacked, ignore_errors=True)


def _rig_note(rig: Rig) -> str:
    return f"A rig of {', '.join(frame.name for frame in rig.frames)}"


def _the_only(unpacked: Path) -> Path:
    """Return the rig, pair or recording in a folder; the folder itself if there is none.

    Raises:
        InputError: there are several.
    """
    found: list[Path] = []
    for place in [unpacked, *sorted(unpacked.rglob("*"))]:
        inside = any(outer in place.parents for outer in found)
        if not inside and (is_rig(place) or is_pair(place) or is_recording(place)):
            found.append(place)
    if len(found) > 1:
        names = ", ".join(str(place.relative_to(unpacked)) for place in found[:6])
        raise InputError(f"The ZIP holds {len(found)} rigs or recordings ({names}); pack one of them.")
    return found[0] if found else unpacked


def unpack(path: Path, folder: Path) -> None:
    """Unpack all files of a ZIP into ``folder``.

    Raises:
        InputError: the file cannot be read as a ZIP, or its content is too large.
    """
    with opened_zip(path, "The file cannot be read as a ZIP; pack the recording again.") as archive:
        inside = archive.infolist()
        size_bytes = sum(one.file_size for one in inside)
        if len(inside) > MOST_FILES or size_bytes > UNPACKED_LIMIT_BYTES:
            raise InputError(
                f"The ZIP unpacks to {len(inside):,} files of {size_bytes >> 20:,} MB; the app takes up "
                f"to {MOST_FILES:,} of {UNPACKED_LIMIT_BYTES >> 20:,} MB, so {INSTEAD}."
            )
        archive.extractall(folder)


def _used(
    path: Path, place: Path, frames: int | None, depth_scale: float | None
) -> Generator[Progress, None, ReadRecording]:
    """Import ``frames`` frames of a recording as a rig to ``place``; None: move the recording to ``place``,
    or next to it if it is a file, which keeps its name.
    """
    if frames is not None:
        report = yield from iterate_checked_import(path, place, frames, depth_scale)
        found = f"{report.kind}: {len(report.frames)} of {report.candidates} frames became nodes"
        return ReadRecording(RigFolder(str(place)), (found, *report.notes))
    opened = yield from iterate_opening(path, depth_scale)  # reports errors of the recording now
    note = f"{opened.kind}: {len(opened.times_s)} frames become one surface"
    place = place.with_name(path.name) if path.is_file() else place  # a bag keeps its name
    return ReadRecording(Recorded(str(path.rename(place)), depth_scale), (note,))
