"""The room as MCAP files of Foxglove's schemas, written by the mcap package."""

from __future__ import annotations

from pathlib import Path

from pipeline.types import Rig
from tests.pipeline.importing.foxglove_files import write_foxglove


def write_protobuf(folder: Path, rig: Rig) -> Path:
    """Images as they are, in protocol buffers."""
    return write_foxglove(folder / "room.mcap", rig)


def write_json(folder: Path, rig: Rig) -> Path:
    """Images as PNG, in base64."""
    return write_foxglove(folder / "room.mcap", rig, "json", compressed=True)
