"""Where a rig comes from: every source has a title, loads its rig, and knows its command-line arguments.

Reading images needs large libraries, so they are imported when a source is loaded and not before.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeAlias

from pipeline.types import Rig

MILLIMETRES = 1000.0
"""Depth units in one metre where nothing else is said."""


class Source(Protocol):
    """Anything that gives a rig; equal sources give equal rigs, so results are cached by them."""

    @property
    def title(self) -> str:
        """What to call it."""
        ...

    def load(self) -> Rig:
        """The images, with the truth where it is known.

        Raises:
            InputError: a file is missing or cannot be used.
        """
        ...

    def arguments(self) -> list[str]:
        """The options of ``packetmesh reconstruct`` that name it."""
        ...


@dataclass(frozen=True, slots=True)
class Demo:
    """A demo scene that ships."""

    name: str

    @property
    def title(self) -> str:
        return self.name

    def load(self) -> Rig:
        from pipeline.io.demos import load_demo

        return load_demo(self.name)

    def arguments(self) -> list[str]:
        return ["--scene", self.name]


@dataclass(frozen=True, slots=True)
class RigFolder:
    """A folder with node_00, node_01 and so on."""

    path: str

    @property
    def title(self) -> str:
        return self.path

    def load(self) -> Rig:
        from pipeline.io.rigs import load_rig

        return load_rig(self.path)

    def arguments(self) -> list[str]:
        return ["--rig", self.path]


@dataclass(frozen=True, slots=True)
class ImagePair:
    """One registered colour and depth image with the camera's intrinsics."""

    color: str
    depth: str
    intrinsics: str
    depth_scale: float = MILLIMETRES
    """Depth image units in one metre."""

    @property
    def title(self) -> str:
        color = Path(self.color)
        return f"{color.parent.name}/{color.name}"

    def load(self) -> Rig:
        from pipeline.io.rigs import load_frame

        frame = load_frame(self.color, self.depth, self.intrinsics, self.depth_scale)
        return Rig(self.title, (frame,))

    def arguments(self) -> list[str]:
        files = ["--color", self.color, "--depth", self.depth, "--intrinsics", self.intrinsics]
        return (
            files if self.depth_scale == MILLIMETRES else [*files, "--depth-scale", f"{self.depth_scale:g}"]
        )


@dataclass(frozen=True, slots=True, eq=False)
class LoadedRig:
    """A rig that is in memory already; it equals only itself."""

    rig: Rig

    @property
    def title(self) -> str:
        return self.rig.name

    def load(self) -> Rig:
        return self.rig

    def arguments(self) -> list[str]:
        return ["--rig", self.rig.name]


FileSource: TypeAlias = Demo | RigFolder | ImagePair
"""The sources that a command line can name."""
