"""A network in the address: the controls whose values differ from the preset's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from packetmesh.errors import InputError


def text_of(values: Mapping[str, str], own: Mapping[str, str]) -> str:
    """Return ``name=value;name=value`` of the values that differ from ``own``."""
    return ";".join(f"{name}={value}" for name, value in values.items() if value != own.get(name, ""))


def values_of(text: str) -> dict[str, str]:
    """Return the values by their names."""
    return dict(part.partition("=")[::2] for part in text.split(";") if part)


def shown(handle: Any) -> str:
    """Return the value of a control as text."""
    value = handle.value
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def show(name: str, handle: Any, text: str) -> None:
    """Set a control to a value.

    Raises:
        InputError: the control does not take it.
    """
    value: Any = None
    if isinstance(handle.value, bool):
        value = {"true": True, "false": False}.get(text)
    elif isinstance(handle.value, str):
        value = text if text in handle.options else None
    else:
        try:
            number = type(handle.value)(text)
            value = number if handle.min <= number <= handle.max else None
        except ValueError:
            value = None
    if value is None:
        raise InputError(
            f"The address has {name}={text[:40]}, which the control of the Network screen does not accept; "
            "set the control there"
        )
    if handle.value != value:
        handle.value = value
