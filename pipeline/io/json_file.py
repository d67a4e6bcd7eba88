"""Strict JSON files from records and arrays."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from pipeline.io.atomic import atomic_path


def write_json(path: Path, value: Any) -> None:
    """Write ``value`` as strict JSON (NaN and infinity become null)."""
    with atomic_path(path) as temporary:
        Path(temporary).write_text(json.dumps(finite(value), indent=1, allow_nan=False) + "\n")


def finite(value: Any) -> Any:
    """``value`` with records and arrays as plain lists and non-finite numbers as None."""
    if isinstance(value, dict):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if hasattr(value, "tolist"):
        return finite(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
