"""Configs as text: preset names, ``key=value`` settings and the ``config.json`` beside every result."""

from __future__ import annotations

import dataclasses
import json
import math
import types
import typing
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

from pipeline.config import PRESETS, PipelineConfig
from pipeline.errors import InputError


def load_config(preset: str) -> PipelineConfig:
    """The preset of that name, or the config saved in that JSON file.

    Raises:
        InputError: neither a preset nor a readable config.
    """
    if preset in PRESETS:
        return PRESETS[preset]
    if not preset.endswith(".json"):
        raise InputError(f"There is no preset '{preset}'; try {' or '.join(PRESETS)}, or a config.json file")
    try:
        values = json.loads(Path(preset).read_text())
    except (OSError, ValueError) as error:
        raise InputError(
            f"The config file {preset} cannot be read ({error}); try one that a run wrote"
        ) from None
    text = values.get("settings") if isinstance(values, dict) else None
    if not isinstance(text, dict):
        raise InputError(f"The config file {preset} has no settings; try the config.json of a finished run")
    return _replaced(PipelineConfig(), {key: str(value) for key, value in text.items()})


def with_settings(config: PipelineConfig, settings: Iterable[str]) -> PipelineConfig:
    """``config`` with settings such as ``"depth.alignment=median"`` applied.

    Raises:
        InputError: an unknown key or a value that the key does not take.
    """
    values = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals:
            raise InputError(
                f"'{setting}' is not a setting; try key=value, for example depth.alignment=median"
            )
        values[key.strip()] = value.strip()
    return _replaced(config, values)


def settings(config: PipelineConfig) -> dict[str, str]:
    """All settings of ``config`` by dotted key, as text that ``with_settings`` reads back."""
    return _as_text(dataclasses.asdict(config))


def differences(config: PipelineConfig, base: PipelineConfig) -> list[str]:
    """The settings, as ``key=value``, that turn ``base`` into ``config``."""
    before = settings(base)
    return [f"{key}={value}" for key, value in settings(config).items() if before[key] != value]


def _as_text(values: dict[str, Any], prefix: str = "") -> dict[str, str]:
    text: dict[str, str] = {}
    for key, value in values.items():
        if isinstance(value, dict):
            text |= _as_text(value, f"{prefix}{key}.")
        elif isinstance(value, list | tuple):
            text[prefix + key] = ",".join(str(item) for item in value)
        elif isinstance(value, bool) or value is None:
            text[prefix + key] = str(value).lower()
        else:
            text[prefix + key] = str(value)
    return text


def _replaced(config: Any, values: dict[str, str], prefix: str = "") -> Any:
    hints = typing.get_type_hints(type(config))
    changes: dict[str, Any] = {}
    for key in {key.partition(".")[0] for key in values}:
        if key not in hints:
            raise InputError(f"There is no setting '{prefix}{key}'; known here: {', '.join(sorted(hints))}")
        inner = {k.partition(".")[2]: v for k, v in values.items() if k.partition(".")[0] == key}
        if dataclasses.is_dataclass(hints[key]) != all(inner):
            raise InputError(f"'{prefix}{key}' is not a single setting; try {prefix}{key}.NAME=value")
        if dataclasses.is_dataclass(hints[key]):
            changes[key] = _replaced(getattr(config, key), inner, f"{prefix}{key}.")
        else:
            changes[key] = _parsed(hints[key], inner[""], prefix + key)
    return dataclasses.replace(config, **changes)


def _parsed(hint: Any, text: str, key: str) -> Any:
    """``text`` as a value of the type ``hint``."""
    if typing.get_origin(hint) is Literal:
        if text not in typing.get_args(hint):
            raise InputError(f"{key}={text} is not possible; try one of {', '.join(typing.get_args(hint))}")
        return text
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        return None if text == "none" else _parsed(typing.get_args(hint)[0], text, key)
    if hint is bool:
        return _parsed(Literal["true", "false"], text, key) == "true"
    if typing.get_origin(hint) is tuple:
        return tuple(_parsed(float, item, key) for item in text.split(",") if item)
    try:
        value = hint(text)
    except ValueError:
        raise InputError(f"{key}={text} is not a number; try {key}={hint(1)}") from None
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{key}={text} is not finite; try {key}=1.0")
    return value
