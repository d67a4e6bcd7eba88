"""Config fields as controls, and back."""

import pytest

import app.screens.depth.settings as depth
import app.screens.fuse.panel as fuse
import app.screens.surface.settings as surface
from app.window import controls
from app.window.controls import Choice, Number, Toggle
from packetmesh.errors import InputError
from pipeline.config import PRESETS, PipelineConfig

ALL = (*depth.FIRST, *depth.CONFIDENCE_CONTROLS, *depth.ADVANCED, *fuse.ADVANCED, *surface.ADVANCED)


@pytest.mark.parametrize("control", ALL, ids=lambda control: control.path)
@pytest.mark.parametrize("preset", PRESETS)
def test_what_is_shown_goes_back_to_the_same_config(control, preset):
    config = PRESETS[preset]
    assert controls.stored(control, controls.shown(control, config), config) == config


@pytest.mark.parametrize("control", ALL, ids=lambda control: control.path)
def test_every_control_explains_itself(control):
    assert len(controls.hint_of(control)) > 20


def test_every_option_of_a_choice_can_be_set():
    for control in ALL:
        if isinstance(control, Choice):
            for option in controls.options_of(control.path):
                display = control.names.get(option, option)
                config = controls.stored(control, display, PipelineConfig())
                assert controls.get(config, control.path) == option


def test_units_are_converted_both_ways():
    gate_cm = Number("Gate (cm)", "node_registration.gate_m", 1.0, 100.0, 0.5, per_unit=100.0)
    config = controls.stored(gate_cm, 12.5, PipelineConfig())
    assert config.node_registration.gate_m == pytest.approx(0.125)
    assert controls.shown(gate_cm, config) == pytest.approx(12.5)


def test_integers_stay_integers():
    config = controls.stored(depth.ADVANCED[1], 7.0, PipelineConfig())
    assert type(config.acquisition.outlier_neighbours) is int


def test_a_toggle_is_boolean():
    config = controls.stored(Toggle("Crop", "depth.crop"), 1, PipelineConfig())
    assert config.depth.crop is True


def test_a_refused_value_is_an_input_error():
    with pytest.raises(InputError, match="max_points"):
        controls.put(PipelineConfig(), "surface.max_points", 0)
