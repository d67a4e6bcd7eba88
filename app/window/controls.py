"""Controls for config fields: labels with units, and hints from the field's own docstring."""

from __future__ import annotations

import dataclasses
import functools
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from app.window.gui import Gui
from app.window.ui import Ui
from packetmesh.settings_help import field_docs
from pipeline.config import PipelineConfig

if TYPE_CHECKING:
    import viser


@dataclass(frozen=True, slots=True)
class Choice:
    """A drop-down over the values of a ``Literal`` field."""

    label: str
    path: str
    """Dotted name of the field, such as ``depth.alignment``."""
    names: Mapping[str, str] = field(default_factory=dict)
    """Labels of the values; a value that is missing is its own label."""
    hint: str | None = None
    """Hint of the control; None takes the field's docstring."""


@dataclass(frozen=True, slots=True)
class Number:
    """A slider over a numeric field."""

    label: str
    """Label with the unit shown in the app."""
    path: str
    least: float
    most: float
    step: float
    """Step of the slider; like its ends, in the unit shown."""
    per_unit: float = 1.0
    """Shown units per unit of the field: 100 for a field in metres shown in cm."""
    hint: str | None = None


@dataclass(frozen=True, slots=True)
class Toggle:
    """A checkbox over a boolean field."""

    label: str
    path: str
    hint: str | None = None


Control = Choice | Number | Toggle


def get(config: Any, path: str) -> Any:
    """Return the value at a dotted path."""
    return functools.reduce(getattr, path.split("."), config)


def put(config: Any, path: str, value: Any) -> Any:
    """Return ``config`` with the value at a dotted path replaced.

    Raises:
        InputError: the config refuses the value.
    """
    head, _, rest = path.partition(".")
    inner = put(getattr(config, head), rest, value) if rest else value
    return dataclasses.replace(config, **{head: inner})


def hint_of(control: Control) -> str:
    """Return the hint: what the control does, in one or two sentences."""
    if control.hint is not None:
        return control.hint
    owner, name = _owner(control.path)
    return field_docs(owner).get(name, "")


def shown(control: Control, config: PipelineConfig) -> Any:
    """Return the field's value as the control shows it; numbers within the slider's ends."""
    value = get(config, control.path)
    if isinstance(control, Choice):
        return control.names.get(value, value)
    if isinstance(control, Number):
        lowest, highest = control.least, control.most
        return type(control.step)(min(max(value * control.per_unit, lowest), highest))
    return bool(value)


def stored(control: Control, display: Any, config: PipelineConfig) -> PipelineConfig:
    """Return ``config`` with the value that the control shows.

    Raises:
        InputError: the config refuses the value.
    """
    if isinstance(control, Choice):
        values = {name: value for value, name in control.names.items()}
        return put(config, control.path, values.get(display, display))
    if isinstance(control, Number):
        value = display / control.per_unit if control.per_unit != 1.0 else display
        return put(config, control.path, type(get(config, control.path))(value))
    return put(config, control.path, bool(display))


class Controls:
    """The controls of some config fields, kept equal to the session's config."""

    def __init__(
        self,
        ui: Ui,
        controls: Sequence[Control],
        config: PipelineConfig,
        on_change: Callable[[Callable[[PipelineConfig], PipelineConfig]], None],
    ) -> None:
        """Add the controls to the current container.

        Args:
            ui: the panel to add them to.
            controls: the fields' controls.
            config: the config whose values they show first.
            on_change: called with each edit that the user makes.
        """
        self._controls = tuple(controls)
        self._handles = [_add(ui.gui, control, config) for control in controls]
        for control, handle in zip(self._controls, self._handles, strict=True):
            ui.when_changed(handle, functools.partial(self._edited, control, handle, on_change))

    def write(self, config: PipelineConfig) -> None:
        """Show the values of another config."""
        for control, handle in zip(self._controls, self._handles, strict=True):
            value = shown(control, config)
            if handle.value != value:
                handle.value = value

    @staticmethod
    def _edited(
        control: Control,
        handle: viser.GuiInputHandle,
        on_change: Callable[[Callable[[PipelineConfig], PipelineConfig]], None],
    ) -> None:
        on_change(lambda config: stored(control, handle.value, config))


def _add(gui: Gui, control: Control, config: PipelineConfig) -> Any:
    hint, value = hint_of(control), shown(control, config)
    if isinstance(control, Choice):
        options = [control.names.get(option, option) for option in options_of(control.path)]
        return gui.add_dropdown(control.label, options, initial_value=value, hint=hint)
    if isinstance(control, Number):
        return gui.add_slider(
            control.label, control.least, control.most, control.step, initial_value=value, hint=hint
        )
    return gui.add_checkbox(control.label, value, hint=hint)


def options_of(path: str) -> tuple[str, ...]:
    """Return the values that a ``Literal`` field takes.

    Raises:
        TypeError: the field has another type.
    """
    owner, name = _owner(path)
    hint = typing.get_type_hints(owner)[name]
    if typing.get_origin(hint) is not Literal:
        raise TypeError(f"{path} is not a choice")
    return typing.get_args(hint)


def _owner(path: str) -> tuple[type, str]:
    """Return the dataclass that has the field at a dotted path, and the field's name."""
    parents, _, name = path.rpartition(".")
    owner: type = type(get(PipelineConfig(), parents))
    return owner, name
