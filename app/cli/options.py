"""Options that several commands share."""

from __future__ import annotations

from typing import Annotated

import tyro

from pipeline.config import PRESETS

Settings = Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="KEY=VALUE")]
PresetName = Annotated[str, tyro.conf.arg(metavar="{" + "|".join(PRESETS) + "|FILE.json}")]
