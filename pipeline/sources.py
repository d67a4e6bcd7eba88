"""Sources of rigs: each has a title and knows its command-line arguments; those on disk also their paths.

``stages.open_rig`` loads the rig of any source; sources of images have ``load``. Equal sources give equal
rigs, so that results are cached by source. Reading images needs large libraries, so they are imported only
when a source is loaded.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from packetmesh.errors import InputError
from pipeline.types import Rig

if TYPE_CHECKING:
    from collections.abc import Generator

    from packetmesh.progress import Progress
    from pipeline.importing.recorded import BagRecording, FolderRecording
    from pipeline.io.calibrations import NodeFiles


@dataclass(frozen=True, slots=True)
class Demo:
    """A demo scene that comes with PacketMesh."""

    name: str

    @property
    def title(self) -> str:
        return self.name

    @property
    def paths(self) -> tuple[Path, ...]:
        return ()

    def load(self) -> Rig:
        return self.load_with(None)

    def load_with(self, calibration: str | None) -> Rig:
        """Load the rig, with calibration files from a folder instead of its own."""
        from pipeline.io.demos import load_demo

        return load_demo(self.name, calibration)

    def arguments(self) -> list[str]:
        return ["--scene", self.name]


@dataclass(frozen=True, slots=True)
class RigFolder:
    """A folder with node_00, node_01 and so on: images, or recordings of cameras that stand."""

    path: str
    depth_scale: float | None = None
    """Depth units in one metre; by default whole numbers are millimetres, floating-point ones metres."""

    @property
    def title(self) -> str:
        return self.path

    @property
    def paths(self) -> tuple[Path, ...]:
        return (Path(self.path),)

    def load(self) -> Rig:
        return self.load_with(None)

    def load_with(self, calibration: str | None) -> Rig:
        """Load the rig of images, with calibration files from a folder instead of its own."""
        from pipeline.io.rigs import load_rig
        from pipeline.recording.rig import holds_recordings

        if calibration is not None and holds_recordings(self.path):
            raise InputError(
                f"The nodes of {self.path} are recordings, which take no calibration from elsewhere; try to "
                f"copy each node's pose.txt from {calibration} into the rig"
            )
        return load_rig(self.path, calibration, self.depth_scale)

    def arguments(self) -> list[str]:
        return ["--rig", self.path, *_depth_scale_argument(self.depth_scale)]


@dataclass(frozen=True, slots=True)
class ImagePair:
    """One colour and depth image with the camera's intrinsics."""

    color: str
    depth: str
    intrinsics: str
    depth_scale: float | None = None
    """Depth units in one metre; by default whole numbers are millimetres, floating-point ones metres."""
    depth_intrinsics: str | None = None
    """Intrinsics of the depth camera if the depth image is not registered to colour; needs ``extrinsics``."""
    extrinsics: str | None = None
    """File with ``T_color_depth``, the pose of the depth camera in the colour camera."""

    @property
    def title(self) -> str:
        color = Path(self.color)
        return f"{color.parent.name}/{color.name}"

    @property
    def paths(self) -> tuple[Path, ...]:
        cameras = (Path(str(file)) for file in self._files().values())
        return (Path(self.color), Path(self.depth), *cameras)

    def load(self) -> Rig:
        return self.load_with(None)

    def load_with(self, calibration: str | None) -> Rig:
        """Load the pair; a calibration's folder replaces its camera files with those of node_00."""
        from pipeline.io.calibrations import calibration_files
        from pipeline.io.rigs import load_frame

        files = self._files()
        if calibration is not None:
            files |= calibration_files(calibration, ["node_00"])["node_00"]
        return Rig(self.title, (load_frame(self.color, self.depth, depth_scale=self.depth_scale, **files),))

    def _files(self) -> NodeFiles:
        """Return the calibration files given with the images."""
        files: NodeFiles = {"intrinsics": self.intrinsics}
        if self.depth_intrinsics is not None:
            files["depth_intrinsics"] = self.depth_intrinsics
        if self.extrinsics is not None:
            files["extrinsics"] = self.extrinsics
        return files

    def arguments(self) -> list[str]:
        words = ["--color", self.color, "--depth", self.depth]
        for name, path in self._files().items():
            words += [f"--{name.replace('_', '-')}", str(path)]
        return [*words, *_depth_scale_argument(self.depth_scale)]


@dataclass(frozen=True, slots=True)
class Calibrated:
    """Another source, with calibration files from a folder instead of its own."""

    source: Demo | RigFolder | ImagePair
    folder: str
    """A rig folder without images: node_00/{intrinsics.json, pose.txt, ...} and so on."""

    @property
    def title(self) -> str:
        return f"{self.source.title}, calibrated by {Path(self.folder).name}"

    @property
    def paths(self) -> tuple[Path, ...]:
        return (*self.source.paths, Path(self.folder))

    def load(self) -> Rig:
        return self.source.load_with(self.folder)

    def arguments(self) -> list[str]:
        return [*self.source.arguments(), "--calibration", self.folder]


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recording; ``stages.open_rig`` averages it if its camera stands, and tracks it if it walks."""

    path: str
    depth_scale: float | None = None
    """Depth units per metre; by default that of the kind of recording."""
    intrinsics: str | None = None
    """Intrinsics of the colour camera; by default the recording's, or those of its kind."""
    demo: str | None = None
    """Name of the demo whose recording it is."""

    @property
    def title(self) -> str:
        return self.demo or self.path

    @property
    def paths(self) -> tuple[Path, ...]:
        return tuple(Path(path) for path in (self.path, self.intrinsics) if path is not None)

    @property
    def true_path(self) -> Path | None:
        """Return the file of the true poses, which only judge the result; None if they are not known."""
        from pipeline.io.demos import TRUE_PATH

        return None if self.demo is None else Path(self.path) / TRUE_PATH

    def iterate_open(self) -> Generator[Progress, None, FolderRecording | BagRecording]:
        """Open the recording; its images are read when they are requested.

        Raises:
            InputError: it cannot be used.
        """
        from pipeline.importing.recorded import iterate_opening

        return (yield from iterate_opening(self.path, self.depth_scale, self.intrinsics))

    def open(self) -> FolderRecording | BagRecording:
        """Open the recording as ``iterate_open`` does."""
        from packetmesh.progress import drain

        return drain(self.iterate_open())

    def arguments(self) -> list[str]:
        if self.demo is not None:
            return ["--scene", self.demo]
        words = ["--recording", self.path]
        if self.intrinsics is not None:
            words += ["--intrinsics", self.intrinsics]
        return [*words, *_depth_scale_argument(self.depth_scale)]


@dataclass(frozen=True, slots=True, eq=False)
class LoadedRig:
    """A rig that is already in memory; it equals only itself."""

    rig: Rig

    @property
    def title(self) -> str:
        return self.rig.name

    def load(self) -> Rig:
        return self.rig

    def arguments(self) -> list[str]:
        return ["--rig", self.rig.name]


def _depth_scale_argument(depth_scale: float | None) -> list[str]:
    return [] if depth_scale is None else ["--depth-scale", f"{depth_scale:g}"]


def demo_of(name: str) -> Demo | Recorded:
    """Return a demo: the recording of this name, else the rig, whose loading fails if there is none."""
    from pipeline.io.demos import DEMO_WALKS, RECORDINGS

    return Recorded(str(RECORDINGS / name), demo=name) if name in DEMO_WALKS else Demo(name)


FileSource: TypeAlias = Demo | RigFolder | ImagePair | Calibrated | Recorded
"""Sources that can be given on the command line."""
Source: TypeAlias = FileSource | LoadedRig
"""All sources."""
