"""Help for a config: docstring and unit of every setting."""

from __future__ import annotations

import ast
import dataclasses
import functools
import inspect
import textwrap
from typing import Any, NamedTuple

from packetmesh.settings import settings

UNITS = {
    "m": "m",
    "mps": "m/s",
    "s": "s",
    "hz": "Hz",
    "bps": "bit/s",
    "bytes": "B",
    "px": "px",
    "deg": "°",
    "db": "dB",
    "dbm": "dBm",
    "w": "W",
    "j": "J",
    "packets": "packets",
    "images": "images",
    "per_h": "1/h",
}
"""Unit of a setting, by the last part of its name."""

UNITLESS = {"nakagami_m"}
"""Names that have no unit although their last part is a key of ``UNITS``."""


class Setting(NamedTuple):
    """One row of the help."""

    key: str
    value: str
    """Text that ``with_settings`` parses."""
    unit: str
    """Empty for a choice, a name or a number without a unit."""
    doc: str


def describe(config: Any, prefix: str = "") -> list[Setting]:
    """Return every setting of ``config`` with its value, unit and meaning, in the order of its fields.

    ``prefix`` is put before every key, for a config within another.
    """
    rows: list[Setting] = []
    kind: type = type(config)
    text, docs = settings(config), field_docs(kind)
    for field in dataclasses.fields(config):
        key, value = prefix + field.name, getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            rows += describe(value, f"{key}.")
        else:
            rows.append(Setting(key, text[field.name], unit_of(key), docs.get(field.name, "")))
    return rows


def unit_of(key: str) -> str:
    """Return the unit in which a setting's name ends (``m`` for ``radio.range_m``); empty without one."""
    name = key.rpartition(".")[2]
    if name in UNITLESS or "_" not in name:
        return ""
    return next((unit for end, unit in UNITS.items() if name.endswith(f"_{end}")), "")


@functools.cache
def field_docs(kind: type) -> dict[str, str]:
    """Read the docstrings under a dataclass's fields from its source, each as one line."""
    definition = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    assert isinstance(definition, ast.ClassDef)
    docs = {}
    for field, below in zip(definition.body, definition.body[1:], strict=False):
        match field, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                docs[name] = " ".join(text.split())
    return docs
