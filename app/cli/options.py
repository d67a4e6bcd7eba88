"""Options that several commands share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.text import wrong_use
from pipeline.config import PRESETS

if TYPE_CHECKING:
    from pipeline.sources import Demo, FileSource, ImagePair, Recorded, RigFolder

Settings = Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="KEY=VALUE")]
PresetName = Annotated[str, tyro.conf.arg(metavar="{" + "|".join(PRESETS) + "|FILE.json}")]


@dataclass(frozen=True)
class SourceOptions:
    """The images: a demo scene, a rig, a recording, or a single pair."""

    scene: str | None = None
    """A demo scene (see `packetmesh scenes`)."""
    rig: Path | None = None
    """A folder with node_00/{color.png, depth.png, intrinsics.json, pose.txt}, node_01/...; `reconstruct`
    also takes a recording that `import` can read."""
    recording: Path | None = None
    """A recording of any kind that `import` can read. All frames of a walking camera are used; of one that
    stands, up to 64 are averaged (`--set recording.frames=16`)."""
    color: Path | None = None
    """Colour image of a single RGB-D pair."""
    depth: Path | None = None
    """Its 16-bit depth image."""
    intrinsics: Path | None = None
    """Intrinsics of its camera: JSON with fx, fy, cx, cy; Open3D JSON; or ROS camera_info. With a recording:
    those of its colour camera, instead of its own."""
    depth_scale: float | None = None
    """Depth units per metre in the depth images of a pair, a rig or a recording; without it, whole numbers
    are millimetres and floating-point numbers metres, or as the kind of recording has them."""
    depth_intrinsics: Path | None = None
    """Intrinsics of the depth camera, if the depth image is not registered to the colour image."""
    extrinsics: Path | None = None
    """Pose of the depth camera: JSON with T_color_depth, four rows of four numbers, metres."""
    calibration: Path | None = None
    """Folder of a calibration; its node_00/{intrinsics.json, pose.txt, ...} replace those of the images."""

    def source(self) -> FileSource:
        """Return the source that the options name; exit with 2 if they name none or more than one."""
        if self.recording is not None:
            return self._recorded()
        from pipeline.sources import Calibrated, Recorded

        source = self._images()
        if self.calibration is None:
            return source
        if isinstance(source, Recorded):
            wrong_use(f"the demo {source.title} is a recording, which takes no --calibration: leave it out")
        return Calibrated(source, str(self.calibration))

    def nothing_but_scale(self, option: str) -> None:
        """Exit with 2 if the options name images; only the depth scale may be given with ``option``."""
        if replace(self, depth_scale=None) != SourceOptions():
            wrong_use(f"{option} takes no other images: leave out --scene, --rig, --color and their options")

    def _recorded(self) -> Recorded:
        """Return the recording; exit with 2 if other images are given."""
        alone = SourceOptions(intrinsics=self.intrinsics, depth_scale=self.depth_scale)
        if replace(self, recording=None) != alone:
            wrong_use("--recording takes no other images: leave out all but --intrinsics and --depth-scale")
        from pipeline.sources import Recorded

        intrinsics = None if self.intrinsics is None else str(self.intrinsics)
        return Recorded(str(self.recording), self.depth_scale, intrinsics)

    def _images(self) -> Demo | RigFolder | ImagePair | Recorded:
        pair = (self.color, self.depth, self.intrinsics, self.depth_intrinsics, self.extrinsics)
        ways = [self.scene is not None, self.rig is not None, any(part is not None for part in pair)]
        if sum(ways) != 1:
            wrong_use(
                "give the images to reconstruct: --scene NAME, --rig DIR, --recording DIR, or --color C "
                "--depth D --intrinsics K"
            )
        from pipeline.sources import ImagePair, RigFolder, demo_of

        if self.scene is not None:
            if self.depth_scale is not None:
                wrong_use("a demo scene has its own depth scale: leave out --depth-scale")
            return demo_of(self.scene)
        if self.rig is not None:
            return RigFolder(str(self.rig), self.depth_scale)
        if self.color is None or self.depth is None or self.intrinsics is None:
            wrong_use("a single pair needs all of --color, --depth and --intrinsics")
        if (self.depth_intrinsics is None) != (self.extrinsics is None):
            wrong_use("a depth image that is not registered needs both --depth-intrinsics and --extrinsics")
        poses = (None if part is None else str(part) for part in (self.depth_intrinsics, self.extrinsics))
        images = str(self.color), str(self.depth), str(self.intrinsics)
        return ImagePair(*images, self.depth_scale, *poses)


Images = Annotated[SourceOptions, tyro.conf.arg(name="")]
