"""An uploaded recording becomes a rig."""

from __future__ import annotations

import shutil
from collections.abc import Generator
from pathlib import Path

from app.screens.scene.recording import ReadRecording
from app.state import Spec
from app.store import Store
from app.zips import opened_zip
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.importing import is_recording, iterate_import
from pipeline.io.rigs import load_rig
from pipeline.sources import RigFolder

UNPACKED_LIMIT_BYTES = 1 << 30
MOST_FILES = 20_000
INSTEAD = "use packetmesh import and reconstruct for larger ones"


def recording_job(
    store: Store, spec: Spec, path: Path, name: str
) -> Generator[Progress, None, ReadRecording]:
    """Unpack a ZIP and make a rig of what is in it; needs nothing of the chain.

    Args:
        store: not used.
        spec: not used.
        path: a bag or a ZIP, in a folder of its own.
        name: of the rig, which will lie beside that folder.

    Raises:
        InputError: a file that cannot be read, that is too large, or that holds no recording.
    """
    yield Progress("reading the recording", 0.0)
    rig = path.parent.with_name(name)
    if path.suffix.lower() != ".zip":
        return (yield from _imported(path, rig))
    unpacked = path.with_suffix("")
    try:
        unpack(path, unpacked)
        places = [unpacked, *(folder for folder in sorted(unpacked.rglob("*")) if folder.is_dir())]
        nodes = next((place for place in places if (place / "node_00").is_dir()), None)
        if nodes is not None:
            load_rig(nodes)  # says now what is wrong with it
            nodes.rename(rig)
            return ReadRecording(RigFolder(str(rig)), (f"A rig of {len(list(rig.glob('node_*')))} nodes",))
        files = (file for file in sorted(unpacked.rglob("*")) if file.is_file())
        found = next((place for place in [*places, *files] if is_recording(place)), unpacked)
        return (yield from _imported(found, rig))
    finally:
        shutil.rmtree(unpacked, ignore_errors=True)


def unpack(path: Path, folder: Path) -> None:
    """All files of a ZIP below ``folder``.

    Raises:
        InputError: it cannot be read as a ZIP, or holds too much.
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


def _imported(path: Path, rig: Path) -> Generator[Progress, None, ReadRecording]:
    report = yield from iterate_import(path, rig)
    found = f"{report.kind}: {len(report.frames)} of {report.candidates} frames became nodes"
    return ReadRecording(RigFolder(str(rig)), (found, *report.notes))
