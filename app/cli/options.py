"""Options that several commands share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.text import wrong_use
from pipeline.config import PRESETS

if TYPE_CHECKING:
    from pipeline.sources import FileSource

Settings = Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="KEY=VALUE")]
PresetName = Annotated[str, tyro.conf.arg(metavar="{" + "|".join(PRESETS) + "|FILE.json}")]


@dataclass(frozen=True)
class SourceOptions:
    """The images: a demo scene, a rig, or a single pair."""

    scene: str | None = None
    """A demo scene (see `packetmesh scenes`)."""
    rig: Path | None = None
    """A folder with node_00/{color.png, depth.png, intrinsics.json, pose.txt}, node_01/..."""
    color: Path | None = None
    """Colour image of a single RGB-D pair."""
    depth: Path | None = None
    """Its registered 16-bit depth image."""
    intrinsics: Path | None = None
    """Its camera: JSON with fx, fy, cx, cy; Open3D JSON; or ROS camera_info."""
    depth_scale: float = 1000.0
    """Depth units per metre in the depth image."""

    def source(self) -> FileSource:
        """What they name; exits where they name nothing, or more than one thing."""
        pair = (self.color, self.depth, self.intrinsics)
        ways = [self.scene is not None, self.rig is not None, any(part is not None for part in pair)]
        if sum(ways) != 1:
            wrong_use(
                "say what to reconstruct: --scene NAME, --rig DIR, or --color C --depth D --intrinsics K"
            )
        from pipeline.sources import Demo, ImagePair, RigFolder

        if self.scene is not None:
            return Demo(self.scene)
        if self.rig is not None:
            return RigFolder(str(self.rig))
        if self.color is None or self.depth is None or self.intrinsics is None:
            wrong_use("a single pair needs all of --color, --depth and --intrinsics")
        return ImagePair(str(self.color), str(self.depth), str(self.intrinsics), self.depth_scale)


Images = Annotated[SourceOptions, tyro.conf.arg(name="")]
