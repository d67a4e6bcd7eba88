"""Point cloud files: reading of many formats, and writing of PLY."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import PurePath

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_GEOMETRY_BYTES, atomic_path, read_bytes
from pipeline.io.cloud_arrays import parse_npy, parse_sweep
from pipeline.io.cloud_models import parse_model
from pipeline.io.cloud_npz import parse_npz
from pipeline.io.cloud_pcd import parse_pcd
from pipeline.io.cloud_ply import TYPES, parse_ply
from pipeline.io.cloud_surveys import parse_e57, parse_las
from pipeline.io.cloud_table import COLOR, LABEL, NORMAL, POSITION, cloud_of
from pipeline.io.cloud_text import parse_pts, parse_text
from pipeline.io.cloud_vtk import parse_vtk
from pipeline.types import AnyPath, PointCloud

_PARSERS: dict[str, Callable[[AnyPath, bytes], np.ndarray]] = {
    ".ply": parse_ply,
    ".pcd": parse_pcd,
    ".npz": parse_npz,
    ".npy": parse_npy,
    **dict.fromkeys((".xyz", ".txt", ".asc", ".csv"), parse_text),
    ".pts": parse_pts,
    ".vtk": parse_vtk,
    ".bin": parse_sweep,
    **dict.fromkeys((".obj", ".stl", ".glb"), parse_model),
    **dict.fromkeys((".las", ".laz"), parse_las),
    ".e57": parse_e57,
}
"""Parsers by suffix. A new format is a file with a parser that returns a table, and a line here."""


def read_cloud(path: AnyPath) -> PointCloud:
    """Read points, with normals, colours and source labels if the file has them.

    The suffix determines the format: .ply (also if there is none), .pcd, .npz, .npy, text in .xyz, .txt, .asc
    and .csv, .pts, legacy .vtk, KITTI's .bin, the vertices of .obj, .stl and .glb, and with the extra
    ``clouds`` .las, .laz and .e57. Faces and points that are not finite are ignored.

    Returns:
        (N, 3) points in the file's unit, which should be metres.

    Raises:
        InputError: the file is missing, truncated, too large, of another format or without points.

    >>> from pathlib import Path; import packetmesh as pm
    >>> _ = Path("corners.csv").write_text("x,y,z\\n0,0,1\\n0.5,0,1\\n0,0.5,1\\n")
    >>> pm.read_cloud("corners.csv").points_m[1].tolist()
    [0.5, 0.0, 1.0]
    """
    suffix = PurePath(path).suffix.lower() or ".ply"
    if suffix not in _PARSERS:
        raise InputError(
            f"The point cloud {path} is of a kind that is not read; try one of {', '.join(_PARSERS)}"
        )
    return cloud_of(path, _PARSERS[suffix](path, read_bytes(path, MAX_GEOMETRY_BYTES, "point cloud")))


def write_cloud(path: AnyPath, cloud: PointCloud) -> None:
    """Write a binary PLY: float positions and normals, uchar colours and source label.

    Raises:
        InputError: the name does not end in .ply, or the folder cannot be written.

    >>> import numpy as np, packetmesh as pm
    >>> pm.write_cloud("corners.ply", pm.PointCloud(np.eye(3)))
    >>> len(pm.read_cloud("corners.ply"))
    3
    """
    if not str(path).endswith(".ply"):
        raise InputError(f"{path} is no name for a point cloud; try one that ends in .ply")
    fields: list[tuple[str, str, np.ndarray]]
    fields = [(name, "float", cloud.points_m[:, axis]) for axis, name in enumerate(POSITION)]
    if cloud.normals is not None:
        fields += [(name, "float", cloud.normals[:, axis]) for axis, name in enumerate(NORMAL)]
    if cloud.colors is not None:
        fields += [(name, "uchar", cloud.colors[:, channel]) for channel, name in enumerate(COLOR)]
    if cloud.source is not None:
        fields.append((LABEL, "uchar", cloud.source))
    table = np.empty(len(cloud), [(name, f"<{TYPES[word]}") for name, word, _ in fields])
    for name, _, column in fields:
        table[name] = column
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(cloud)}"]
    header += [f"property {word} {name}" for name, word, _ in fields]
    with atomic_path(path) as sibling:
        sibling.write_bytes("\n".join([*header, "end_header\n"]).encode("ascii") + table.tobytes())
