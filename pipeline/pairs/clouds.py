"""Reading of the two clouds of a registration, in metres."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.io.clouds import read_cloud, takes_columns
from pipeline.surface.cloud_checks import in_metres
from pipeline.types import PointCloud

AUTO = "auto"


def read_pair(
    source: Path, target: Path, columns: Sequence[str], metres_per_unit: tuple[float, float] | None
) -> tuple[PointCloud, PointCloud]:
    """Read two clouds.

    Args:
        source: file of the cloud that moves.
        target: file of the cloud that stays.
        columns: empty; or one text of columns, as in ``read_cloud``, for both files (a file that names its
            columns itself ignores it); or one text for each file, where ``auto`` finds them in the file.
        metres_per_unit: metres per unit of the source and of the target; None takes the units that the files
            name, or else metres.

    Returns:
        Source and target, in metres.

    Raises:
        InputError: a file, its columns or a unit cannot be used.
    """
    files = (source, target)
    if len(columns) > 2:
        raise InputError(
            f"--columns is given {len(columns)} times; give it once for both clouds, or once for each"
        )
    if len(columns) == 1 and not any(map(takes_columns, files)):
        raise InputError("Both clouds name their columns themselves; try it without --columns")
    named: list[str | None] = [None, None]
    if len(columns) == 1:
        named = [columns[0] if takes_columns(path) else None for path in files]
    elif columns:
        named = [None if text == AUTO else text for text in columns]
    moving, fixed = (
        read_cloud(path, text, header_unit=metres_per_unit is None)
        for path, text in zip(files, named, strict=True)
    )
    units = metres_per_unit or (1.0, 1.0)
    return in_metres(moving, units[0]), in_metres(fixed, units[1])
