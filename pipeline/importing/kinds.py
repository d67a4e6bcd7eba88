"""Supported kinds of recordings, and the recognition of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.importing import (
    arkit,
    associated,
    colmap,
    kinect,
    nerfstudio,
    numbered,
    record3d,
    sens,
    stray,
    tum,
)
from pipeline.importing.bag_reader import SUFFIXES
from pipeline.importing.sequence import Sequence
from pipeline.importing.stored import is_file


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of recording, with the layout of its files and its reader."""

    name: str
    looks_like: str
    """Description of its folder or file for users."""
    recognised: Callable[[Path], bool]
    """Returns whether a folder or file is of this kind."""
    read: Callable[[Path, Path | None], Sequence]
    """Reads the frames; the second argument is an intrinsics file given by the user."""


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
        "sparse/{cameras,images,points3D}.txt or .bin with images/ and stereo/depth_maps/ or depth/",
        colmap.is_colmap,
        colmap.read_colmap,
    ),
    Kind(
        "Stray Scanner",
        "rgb/ or rgb.mp4, depth/, camera_matrix.csv and odometry.csv",
        stray.is_stray,
        stray.read_stray,
    ),
    Kind("Polycam", "keyframes/ with images/, cameras/ and depth/", arkit.is_polycam, arkit.read_polycam),
    Kind(
        "nerfstudio",
        "transforms.json with depth_file_path",
        nerfstudio.is_nerfstudio,
        nerfstudio.read_nerfstudio,
    ),
    Kind(
        "Record3D",
        "metadata.json, rgb/ and depth/ of EXR images",
        record3d.is_record3d,
        record3d.read_record3d,
    ),
    Kind("Record3D .r3d", "a file .r3d", partial(is_file, suffixes=(".r3d",)), record3d.read_r3d),
    Kind(
        "3D Scanner App",
        "frame_00000.json, frame_00000.jpg and depth_00000.png",
        arkit.is_scanner_app,
        arkit.read_scanner_app,
    ),
    Kind("ScanNet .sens", "a file .sens", partial(is_file, suffixes=(".sens",)), sens.read_sens),
    Kind("Azure Kinect or Femto", "a file .mkv", partial(is_file, suffixes=(".mkv",)), kinect.read_kinect),
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
    """Return the kind of a recording and its folder or file: ``path``, or the only recording in it.

    Raises:
        InputError: the path is of no kind, or contains several recordings.
    """
    if not path.exists():
        raise InputError(f"{path} does not exist; check the path")
    kind = kind_of(path)
    if kind is not None:
        return kind, path
    if not path.is_dir():
        raise InputError(
            f"{path} is a file of no known kind; try the folder of an unpacked recording, or a file of a "
            f"kind: {_known()}"
        )
    found = [(kind, place) for place in sorted(path.iterdir()) if (kind := kind_of(place)) is not None]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(place.name for _, place in found[:6])
        raise InputError(f"{path} holds {len(found)} recordings; try one of them: {names}")
    bags = [file for file in sorted(path.iterdir()) if is_file(file, SUFFIXES)]
    if bags:
        raise InputError(f"{path} holds the bag {bags[0].name}; try {bags[0]}")
    raise InputError(f"{path} is of no known kind; the kinds are {_known()}")


def kind_of(path: Path) -> Kind | None:
    """Return the kind of recording in a folder or file; None if it is of no known kind."""
    return next((kind for kind in KINDS if kind.recognised(path)), None)


def _known() -> str:
    folders = (f"{kind.name} ({kind.looks_like})" for kind in KINDS)
    return "; ".join([*folders, "bags of ROS (.bag, .db3, .mcap)"])
