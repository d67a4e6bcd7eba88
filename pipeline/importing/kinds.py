"""Supported kinds of recordings, and the recognition of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.importing import arkit, associated, colmap, nerfstudio, numbered, stray, tum
from pipeline.importing.bag import SUFFIXES
from pipeline.importing.sequence import Sequence


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of recording, with the layout of its files and its reader."""

    name: str
    looks_like: str
    """Description of its folder for users."""
    recognised: Callable[[Path], bool]
    """Returns whether a folder is of this kind, from its files."""
    read: Callable[[Path, Path | None], Sequence]
    """Reads the frames of a folder; the second argument is an intrinsics file given by the user."""


KINDS = (
    Kind("TUM", "rgb.txt and depth.txt", tum.is_tum, tum.read_tum),
    Kind(
        "7-Scenes",
        "frame-000000.color.png, .depth.png and .pose.txt",
        numbered.is_seven_scenes,
        numbered.read_seven_scenes,
    ),
    Kind("ScanNet", "color/, depth/, pose/ and intrinsic/", numbered.is_scannet, numbered.read_scannet),
    Kind(
        "COLMAP",
        "sparse/{cameras,images,points3D}.txt with images/ and stereo/depth_maps/ or depth/",
        colmap.is_colmap,
        colmap.read_colmap,
    ),
    Kind(
        "Stray Scanner", "rgb/, depth/, camera_matrix.csv and odometry.csv", stray.is_stray, stray.read_stray
    ),
    Kind("Polycam", "keyframes/ with images/, cameras/ and depth/", arkit.is_polycam, arkit.read_polycam),
    Kind(
        "nerfstudio",
        "transforms.json with depth_file_path",
        nerfstudio.is_nerfstudio,
        nerfstudio.read_nerfstudio,
    ),
    Kind("Record3D", "metadata.json, rgb/ and depth/ of EXR images", arkit.is_record3d, arkit.read_record3d),
    Kind(
        "ICL-NUIM or ORB-SLAM",
        "associations.txt with rgb/ and depth/",
        associated.is_associated,
        associated.read_associated,
    ),
    Kind("SUN RGB-D", "image/, depth_bfx/ and intrinsics.txt", numbered.is_sunrgbd, numbered.read_sunrgbd),
    Kind(
        "Redwood or Open3D",
        "color/ and depth/, with a trajectory .log",
        numbered.is_open3d,
        numbered.read_open3d,
    ),
)
"""Kinds in the order of recognition: the first match counts."""


def recognise(path: Path) -> tuple[Kind, Path]:
    """Return the kind of a recording and its folder: ``path``, or the only recording in it.

    Raises:
        InputError: the path is no folder, of no kind, or contains several recordings.
    """
    if not path.exists():
        raise InputError(f"{path} does not exist; check the path")
    if not path.is_dir():
        raise InputError(
            f"{path} is a file not named .bag, .db3 or .mcap; try the folder of an unpacked recording: "
            f"{_known()}"
        )
    kind = kind_of(path)
    if kind is not None:
        return kind, path
    inner = [folder for folder in sorted(path.iterdir()) if folder.is_dir()]
    found = [(kind, folder) for folder in inner if (kind := kind_of(folder)) is not None]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(folder.name for _, folder in found[:6])
        raise InputError(f"{path} holds {len(found)} recordings; try one of them: {names}")
    bags = [file for suffix in SUFFIXES for file in sorted(path.glob(f"*{suffix}"))]
    if bags:
        raise InputError(f"{path} holds the bag {bags[0].name}; try {bags[0]}")
    raise InputError(f"{path} is of no known kind; the kinds are {_known()}")


def kind_of(folder: Path) -> Kind | None:
    """Return the kind of recording in a folder; None if it contains none."""
    return next((kind for kind in KINDS if kind.recognised(folder)), None)


def _known() -> str:
    folders = (f"{kind.name} ({kind.looks_like})" for kind in KINDS)
    return "; ".join([*folders, "bags of ROS (.bag, .db3, .mcap)"])
