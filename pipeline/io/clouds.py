"""Point cloud files: reading of many formats, and writing of PLY."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import PurePath

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_GEOMETRY_BYTES, atomic_path, read_bytes
from pipeline.io.cloud_arrays import parse_npy, parse_sweep
from pipeline.io.cloud_columns import check_degrees, parse_columns
from pipeline.io.cloud_header import with_plain_names
from pipeline.io.cloud_models import parse_model
from pipeline.io.cloud_npz import parse_npz
from pipeline.io.cloud_pcd import parse_pcd
from pipeline.io.cloud_ply import TYPES, parse_ply
from pipeline.io.cloud_precision import too_coarse
from pipeline.io.cloud_surveys import parse_e57, parse_las
from pipeline.io.cloud_table import COLOR, LABEL, NORMAL, POSITION, Layout, cloud_of
from pipeline.io.cloud_text import parse_text
from pipeline.io.cloud_vtk import parse_vtk
from pipeline.types import AnyPath, PointCloud

_Parser = Callable[[AnyPath, bytes, Layout], np.ndarray]


def _self_named(parse: Callable[[AnyPath, bytes], np.ndarray]) -> _Parser:
    """Return a parser of a format that names its columns and has no unit."""
    return lambda path, data, layout: parse(path, data)


_PARSERS: dict[str, _Parser] = {
    ".ply": _self_named(parse_ply),
    ".pcd": _self_named(parse_pcd),
    ".npz": _self_named(parse_npz),
    ".vtk": _self_named(parse_vtk),
    **dict.fromkeys((".obj", ".stl", ".glb"), _self_named(parse_model)),
    **dict.fromkeys((".las", ".laz"), parse_las),
    ".e57": _self_named(parse_e57),
    ".npy": parse_npy,
    **dict.fromkeys((".xyz", ".txt", ".asc", ".csv", ".pts"), parse_text),
    ".bin": parse_sweep,
}
"""Parsers by suffix. A new format is a file with a parser that returns a table, and a line here."""
_COLUMNED = (".npy", ".xyz", ".txt", ".asc", ".csv", ".pts", ".bin")
"""Formats whose columns a user can name."""


def takes_columns(path: AnyPath) -> bool:
    """Return whether a user can name the columns of a file with this suffix."""
    return PurePath(path).suffix.lower() in _COLUMNED


def read_cloud(path: AnyPath, columns: str | None = None, header_unit: bool = True) -> PointCloud:
    """Read points, with normals, colours and source labels if the file has them.

    The suffix determines the format: .ply (also if there is none), .pcd, .npz, .npy, text in .xyz, .txt, .asc
    and .csv, .pts, legacy .vtk, .bin sweeps of KITTI and nuScenes, the vertices of .obj, .stl and .glb, and
    with the extra ``clouds`` .las, .laz and .e57. Faces and points that are not finite are ignored.

    Args:
        path: the file.
        columns: columns of text, .npy and .bin files, such as ``x,y,z,_,r,g,b`` (``parse_columns``); without
            it they are found in the file, and doubtful guesses are logged.
        header_unit: whether positions are converted to metres if the titles of the columns, or the coordinate
            system of a LAS file, have another unit.

    Returns:
        The cloud, in the file's unit, which should be metres, unless ``header_unit`` converted it.

    Raises:
        InputError: the file is missing, truncated, too large, of another format or without points; it names
            its columns itself and ``columns`` are given; or its positions are degrees.

    >>> from pathlib import Path; import packetmesh as pm
    >>> _ = Path("corners.csv").write_text("x,y,z\\n0,0,1\\n0.5,0,1\\n0,0.5,1\\n")
    >>> pm.read_cloud("corners.csv").points_m[1].tolist()
    [0.5, 0.0, 1.0]
    """
    suffix = PurePath(path).suffix.lower() or ".ply"
    if suffix not in _PARSERS:
        known = ", ".join(_PARSERS)
        raise InputError(f"The point cloud {path} is of a kind that is not read; try one of {known}")
    layout = Layout(None if columns is None else parse_columns(columns), header_unit)
    if columns is not None and not takes_columns(path):
        raise InputError(f"The point cloud {path} names its columns itself; try it without --columns")
    data = read_bytes(path, MAX_GEOMETRY_BYTES, "point cloud")
    cloud = cloud_of(path, with_plain_names(_PARSERS[suffix](path, data, layout)))
    if header_unit and not takes_columns(path):
        check_degrees(path, cloud.points_m, "--metres-per-unit if they are lengths")
    return cloud


def write_cloud(path: AnyPath, cloud: PointCloud) -> None:
    """Write a binary PLY: float positions and normals, uchar colours and source label.

    Positions are double if float would move a point by more than a tenth of a millimetre.

    Raises:
        InputError: the name does not end in .ply, or the folder cannot be written.

    >>> import numpy as np, packetmesh as pm
    >>> pm.write_cloud("corners.ply", pm.PointCloud(np.eye(3)))
    >>> len(pm.read_cloud("corners.ply"))
    3
    """
    if not str(path).endswith(".ply"):
        raise InputError(f"{path} is no name for a point cloud; try one that ends in .ply")
    word = "double" if too_coarse(cloud.points_m) else "float"
    fields: list[tuple[str, str, np.ndarray]]
    fields = [(name, word, cloud.points_m[:, axis]) for axis, name in enumerate(POSITION)]
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
