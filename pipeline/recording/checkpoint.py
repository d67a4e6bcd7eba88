"""The state of tracking on disk, from which a run that was killed goes on (SPEC 10.1)."""

from __future__ import annotations

import hashlib
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from packetmesh.files import BROKEN_ZIP, atomic_path
from pipeline.importing.recorded import FolderRecording
from pipeline.importing.recorded_bag import BagRecording
from pipeline.recording.recording import Recording
from pipeline.types import FloatArray

VERSION = 4
"""Number to increase when tracking changes, so that older states are not read."""
EVERY_S = 10.0
"""Least time between two writings of the state."""
OLD_S = 14 * 86400.0
"""Age, relative to the newest state, from which a state is deleted."""
GOES_ON = "the tracking so far is kept, and the same command goes on after it"
"""Note on an error of a run of which a state was written."""
State = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """The file with the state of one recording's tracking."""

    path: Path
    resumed_s: float = field(default=0.0, compare=False)
    """Time that earlier, interrupted runs had spent when they last wrote the state."""
    began_s: float = field(default_factory=time.monotonic, compare=False)

    @staticmethod
    def of(path: Path) -> Checkpoint:
        """Return the checkpoint in a file that an earlier run may have written."""
        state = Checkpoint(path).read()
        return Checkpoint(path, 0.0 if state is None else float(state["elapsed_s"]))

    def read(self) -> State | None:
        """Return the state; None if there is none, or if it is damaged."""
        try:
            with np.load(self.path, allow_pickle=False) as stored:
                return {name: stored[name] for name in stored.files}
        except BROKEN_ZIP:
            return None

    def write(self, state: State) -> None:
        """Replace the state; a disk that is full does not stop the tracking."""
        elapsed_s = self.resumed_s + time.monotonic() - self.began_s
        with suppress(InputError), atomic_path(self.path) as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, elapsed_s=elapsed_s, **state)

    def delete(self) -> None:
        """Delete the state."""
        with suppress(OSError):
            self.path.unlink()

    @contextmanager
    def said(self) -> Iterator[None]:
        """Add a note to an error in this block, Ctrl-C for example, if a state was written."""
        try:
            yield
        except BaseException as error:
            if self.path.exists():
                error.add_note(GOES_ON)
            raise


@contextmanager
def deleted_after(state: Path | None) -> Iterator[None]:
    """Delete a file with a state after this block; if it fails, its error says that the state is kept."""
    if state is None:
        yield
        return
    checkpoint = Checkpoint(state)
    with checkpoint.said():
        yield
    checkpoint.delete()


def delete_old() -> None:
    """Delete the states that were written ``OLD_S`` or longer before the newest one."""
    with suppress(OSError):  # deleted by another run
        written_s = {path: path.stat().st_mtime for path in (cache_folder() / "tracking").glob("*.npz")}
        for path in (path for path, at_s in written_s.items() if max(written_s.values()) - at_s > OLD_S):
            path.unlink()


def checkpoint_of(recording: Recording, given: Sequence[FloatArray | None] | None) -> Checkpoint | None:
    """Return the checkpoint of a recording on disk, named by a hash of all that determines its tracking.

    Old states of any recording are deleted.

    None if the recording is not on disk or no frame has depth. Of the images, the hash contains only the
    first depth, in metres, so that it depends on the depth scale.

    Args:
        recording: the frames.
        given: (4, 4) poses from which tracking starts, if there are any.
    """
    if not isinstance(recording, FolderRecording | BagRecording):
        return None
    place = recording.folder if isinstance(recording, FolderRecording) else recording.path
    digest = hashlib.sha256(repr((VERSION, np.__version__, str(place.resolve()))).encode())
    digest.update(files_digest(place).encode())
    views = (recording.view(k) for k in range(len(recording.times_s)))
    view = next((view for view in views if view.depth.valid.any()), None)
    if view is None:
        return None
    for values in (recording.times_s, view.depth.z_m, view.camera.matrix, view.T_color_depth):
        digest.update(np.ascontiguousarray(values).tobytes())
    for T in given or ():
        digest.update(b"none" if T is None else np.ascontiguousarray(T).tobytes())
    delete_old()
    return Checkpoint.of(cache_folder() / "tracking" / f"{digest.hexdigest()[:32]}.npz")


def files_digest(place: Path) -> str:
    """Return a hash of the name, size and time of change of a file, or of all files in a folder."""
    digest = hashlib.sha256()
    for path in sorted(place.rglob("*")) if place.is_dir() else [place]:
        with suppress(OSError):
            stat = path.stat()
            digest.update(repr((str(path.relative_to(place)), stat.st_size, stat.st_mtime_ns)).encode())
    return digest.hexdigest()


def cache_folder() -> Path:
    """Return PacketMesh's folder below the operating system's folder for caches."""
    if "XDG_CACHE_HOME" in os.environ:
        return Path(os.environ["XDG_CACHE_HOME"]) / "packetmesh"
    if sys.platform == "win32" and "LOCALAPPDATA" in os.environ:
        return Path(os.environ["LOCALAPPDATA"]) / "packetmesh" / "cache"
    home = Path(os.path.expanduser("~"))
    return home / ("Library/Caches" if sys.platform == "darwin" else ".cache") / "packetmesh"
