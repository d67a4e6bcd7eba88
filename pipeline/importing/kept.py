"""Conversion of a recording to a folder in TUM's form, which many programs for RGB-D images read."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress, part, spaced
from pipeline.importing.recorded import Check, iterate_opening
from pipeline.importing.rig_folder import check_new, new_folder
from pipeline.importing.tum import UNITS_PER_METRE
from pipeline.io.images import write_color
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import write_tum
from pipeline.io.same_view import alike
from pipeline.types import AnyPath, CameraIntrinsics, FloatArray, RgbdFrame

FARTHEST_M = 65534 / UNITS_PER_METRE
"""Largest depth that the form stores in 16 bits."""


@dataclass(frozen=True, slots=True)
class KeptReport:
    """Result of ``iterate_keep``."""

    kind: str
    folder: str
    """Path of the recording."""
    candidates: int
    """Number of frames of the opened recording, at most ``reading.MOST_FRAMES``."""
    frames: int
    """Number of frames that were written."""
    notes: tuple[str, ...]
    """Notes, one sentence each."""


def iterate_keep(
    path: AnyPath,
    out: AnyPath,
    depth_scale: float | None = None,
    intrinsics: AnyPath | None = None,
    check: Check | None = None,
) -> Generator[Progress, None, KeptReport]:
    """Write the frames of a recording in TUM's form, completely or not at all.

    Of more than ``reading.MOST_FRAMES`` frames every n-th is written; unreadable frames are left out.

    The folder gets ``rgb/``, ``depth/`` (registered to colour, 5000 units in a metre), ``rgb.txt``,
    ``depth.txt``, ``intrinsics.json`` and, if poses are known, ``groundtruth.txt``.

    Args:
        path: the recording's folder, a bag, or a folder with only this recording.
        out: the new folder, or an empty one.
        depth_scale: depth units per metre; by default that of the kind of recording.
        intrinsics: intrinsics file of the colour camera; by default the recording's, or those of its kind.
        check: compares the poses with the depth; None takes them as they are.

    Raises:
        InputError: the path is no usable recording, its camera changes, or the folder cannot be written.
    """
    check_new(Path(out))
    opening = iterate_opening(path, depth_scale, intrinsics)
    recording = yield from part(opening, "files", 0.0, 0.1, detail=True)
    count, of_poses = len(recording.times_s), tuple[str, ...]()
    poses: Sequence[FloatArray | None] | None = recording.T_world_camera
    if check is not None and poses is not None:
        yield Progress("poses", 0.1)
        poses, of_poses = check(recording)
    notes = [*recording.notes, *of_poses]
    left_out: list[str] = []
    with new_folder(Path(out)) as folder:
        writer = _Writer(folder)
        for number in range(count):
            if number % spaced(count, 5) == 0:
                yield Progress(f"frame {number} of {count}", 0.1 + 0.9 * number / count)
            try:
                frame = recording.frame(number)
            except InputError as error:
                left_out.append(str(error))
                continue
            writer.write(frame, float(recording.times_s[number]), None if poses is None else poses[number])
        if writer.camera is None:
            raise InputError(f"No frame of {recording.name} can be read, the first because: {left_out[0]}")
        writer.finish(writer.camera)
    if left_out:
        notes.append(f"{len(left_out)} of {count} frames were left out, the first because: {left_out[0]}")
    if writer.too_far:
        notes.append(f"{writer.too_far} depths beyond {FARTHEST_M:.1f} m, the form's largest, were left out")
    return KeptReport(recording.kind, str(path), count, count - len(left_out), tuple(dict.fromkeys(notes)))


@dataclass(slots=True)
class _Writer:
    """Writer of a folder in TUM's form."""

    folder: Path
    camera: CameraIntrinsics | None = None
    too_far: int = 0
    """Number of depths that were left out."""
    lines: dict[str, list[str]] = field(default_factory=lambda: {"rgb": [], "depth": []})
    path: list[tuple[float, FloatArray]] = field(default_factory=list)
    """Times, seconds, and (4, 4) poses, metres, of the frames that have a pose."""

    def write(self, frame: RgbdFrame, time_s: float, T_world_camera: FloatArray | None) -> None:
        """Write the images of a frame, and keep its pose, if known; depths beyond ``FARTHEST_M`` become 0.

        Raises:
            InputError: the frame's camera differs from that of earlier frames.
        """
        self.camera = frame.intrinsics if self.camera is None else self.camera
        if not alike(frame.intrinsics, self.camera):
            raise InputError(
                f"{frame.name} has another camera than the frames before it, and TUM's form has only one; "
                "try `packetmesh reconstruct --recording` with the recording as it is"
            )
        name = f"{frame.name.removeprefix('frame_')}.png"
        for kind in ("rgb", "depth"):
            (self.folder / kind).mkdir(exist_ok=True)
            self.lines[kind].append(f"{time_s:.6f} {kind}/{name}")
        write_color(self.folder / "rgb" / name, frame.rgb)
        units = np.where(frame.depth.valid, frame.depth.z_m, 0.0).astype(np.float64) * UNITS_PER_METRE
        far = units > FARTHEST_M * UNITS_PER_METRE
        self.too_far += int(far.sum())
        png = cv2.imencode(".png", np.rint(np.where(far, 0.0, units)).astype(np.uint16))[1]
        (self.folder / "depth" / name).write_bytes(png.tobytes())
        if T_world_camera is not None:
            self.path.append((time_s, T_world_camera))

    def finish(self, camera: CameraIntrinsics) -> None:
        """Write the lists and the camera."""
        write_intrinsics(self.folder / "intrinsics.json", camera)
        for name, lines in self.lines.items():
            text = "\n".join(["# timestamp filename", *lines]) + "\n"
            (self.folder / f"{name}.txt").write_text(text, encoding="utf-8")
        if self.path:
            times_s, poses = zip(*self.path, strict=True)
            write_tum(self.folder / "groundtruth.txt", np.array(times_s), poses)
