"""Configs as text: preset names, ``key=value`` settings and the ``config.json`` next to every result."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import types
import typing
from collections.abc import Iterable, Mapping
from typing import Any, Literal, TypeVar

from packetmesh.errors import InputError
from packetmesh.files import read_json

Config = TypeVar("Config")
"""Any config: a frozen dataclass whose fields are settings or further configs."""


def config_named(preset: str, presets: Mapping[str, Config]) -> Config:
    """Return the preset of this name, or the config saved in this JSON file.

    Raises:
        InputError: the name is neither a preset nor a readable config.
    """
    if preset in presets:
        return presets[preset]
    if not preset.endswith(".json"):
        near = difflib.get_close_matches(preset, presets, n=1)
        names = near + [name for name in presets if name not in near]
        raise InputError(f"There is no preset '{preset}'; try {' or '.join(names)}, or a config.json file")
    text = read_json(preset, "config file").get("settings")
    if not isinstance(text, dict):
        raise InputError(f"The config file {preset} has no settings; try the config.json of a finished run")
    defaults = type(next(iter(presets.values())))()
    try:
        return with_settings(defaults, [f"{key}={value}" for key, value in text.items()])
    except InputError as error:
        raise InputError(f"The config file {preset} cannot be used: {error}") from None


def with_settings(config: Config, changes: Iterable[str]) -> Config:
    """Return ``config`` with settings such as ``"depth.alignment=median"`` applied; of equal keys the last.

    Raises:
        InputError: an unknown key (the message offers the nearest known ones) or a value that is invalid for
            its key.

    >>> import packetmesh as pm
    >>> config = pm.with_settings(pm.PRESETS["packetmesh"], ["surface.max_points=5000"])
    >>> config.surface.max_points
    5000
    """
    values = {}
    for setting in changes:
        _, equals, value = setting.partition("=")
        if not equals:
            example = next(f"{key}={value}" for key, value in settings(config).items() if "." in key)
            raise InputError(f"'{setting}' is not a setting; try key=value, for example {example}")
        values[key_of(setting)] = value.strip()
    return _replaced(config, values, list(settings(config)))


def settings(config: Any, prefix: str = "") -> dict[str, str]:
    """Return the dotted key and value of every field of ``config``, as text that ``with_settings`` parses.

    ``prefix`` is put before every key, for a config within another.
    """
    text: dict[str, str] = {}
    for field in dataclasses.fields(config):
        key, value = prefix + field.name, getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            text |= settings(value, f"{key}.")
        elif isinstance(value, list | tuple):
            text[key] = ",".join(str(item) for item in value)
        elif isinstance(value, bool) or value is None:
            text[key] = str(value).lower()
        else:
            text[key] = str(value)
    return text


def key_of(change: str) -> str:
    """Return the key of ``key=value``."""
    return change.partition("=")[0].strip()


def differences(config: Config, base: Config) -> list[str]:
    """Return the settings of ``config`` that differ from ``base``, as ``key=value``."""
    before = settings(base)
    return [f"{key}={value}" for key, value in settings(config).items() if before[key] != value]


_hints_of = functools.cache(typing.get_type_hints)


def _replaced(config: Any, values: dict[str, str], known: list[str], prefix: str = "") -> Any:
    """Return ``config`` with ``values`` applied, whose keys are without ``prefix``.

    ``known`` has all keys of the outermost config, from which errors offer the nearest.
    """
    hints = _hints_of(type(config))  # type: ignore[arg-type]
    changes: dict[str, Any] = {}
    for key in {key.partition(".")[0] for key in values}:
        inner = {k.partition(".")[2]: v for k, v in values.items() if k.partition(".")[0] == key}
        if key not in hints:
            raise _unknown(".".join(filter(None, (prefix + key, next(iter(inner))))), known)
        nested = dataclasses.is_dataclass(hints[key])
        if nested and "" in inner:
            raise InputError(f"'{prefix}{key}' is not a single setting; try {prefix}{key}.NAME=value")
        if not nested and any(inner):
            raise InputError(f"'{prefix}{key}' is a single setting; try {prefix}{key}=VALUE")
        if nested:
            changes[key] = _replaced(getattr(config, key), inner, known, f"{prefix}{key}.")
        else:
            changes[key] = _parsed(hints[key], inner[""], prefix + key)
    return dataclasses.replace(config, **changes)


def _unknown(key: str, known: list[str]) -> InputError:
    """Return the error for an unknown key; it offers known keys similar to the key or its last part."""
    last = key.rpartition(".")[2]
    near = [name for name in known if name.rpartition(".")[2] == last]
    near += [name for name in difflib.get_close_matches(key, known, n=3) if name not in near]
    if not near:
        names = difflib.get_close_matches(last, {name.rpartition(".")[2] for name in known}, n=3)
        near = [name for name in known if name.rpartition(".")[2] in names]
    if not near:
        near = [name for name in known if name.partition(".")[0] == key.partition(".")[0]] or known
    return InputError(f"There is no setting '{key}'; try {' or '.join(near[:6])}")


def _parsed(hint: Any, text: str, key: str) -> Any:
    """Parse ``text`` as a value of type ``hint``, or raise an ``InputError`` that names ``key``."""
    if typing.get_origin(hint) is Literal:
        if text not in typing.get_args(hint):
            raise InputError(f"{key}={text} is not possible; try one of {', '.join(typing.get_args(hint))}")
        return text
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        return None if text == "none" else _parsed(typing.get_args(hint)[0], text, key)
    if hint is bool:
        return _parsed(Literal["true", "false"], text, key) == "true"
    if typing.get_origin(hint) is tuple:
        return tuple(_parsed(typing.get_args(hint)[0], item, key) for item in text.split(",") if item)
    try:
        value = hint(text)
    except ValueError:
        kind = "whole number in digits" if hint is int else "number"
        raise InputError(f"{key}={text} is not a {kind}; try {key}={hint(1)}") from None
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{key}={text} is not finite; try {key}=1.0")
    return value
