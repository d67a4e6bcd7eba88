"""Configs as text: settings are parsed as they were written, and a wrong one is a clear error."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from network_sim.config import NetworkConfig
from network_sim.presets import PRESETS as NETWORKS
from packetmesh.errors import InputError
from packetmesh.files import write_json
from packetmesh.settings import config_named, differences, settings, with_settings
from pipeline.config import PRESETS, PipelineConfig

DEFAULT = PipelineConfig()


@pytest.mark.parametrize("name", PRESETS)
def test_settings_read_back_to_the_same_config(name):
    text = [f"{key}={value}" for key, value in settings(PRESETS[name]).items()]
    assert with_settings(DEFAULT, text) == PRESETS[name]


@given(
    gate_m=st.floats(1e-3, 10),
    points=st.integers(6, 10**6),
    radii_m=st.lists(st.floats(1e-4, 1.0), max_size=5),
    sigma_min_m=st.none() | st.floats(1e-4, 1.0),
)
def test_differences_turn_one_config_into_the_other(gate_m, points, radii_m, sigma_min_m):
    changed = with_settings(
        PRESETS["thesis"],
        [
            f"node_registration.gate_m={gate_m}",
            f"node_registration.max_points={points}",
            f"surface.radii_m={','.join(map(str, radii_m))}",
            f"node_registration.sigma_min_m={str(sigma_min_m).lower()}",
        ],
    )
    assert changed.node_registration.gate_m == gate_m
    assert changed.surface.radii_m == tuple(radii_m)
    assert changed.node_registration.sigma_min_m == sigma_min_m
    assert with_settings(DEFAULT, differences(changed, DEFAULT)) == changed


def test_a_config_has_no_differences_from_itself():
    assert differences(PRESETS["thesis"], PRESETS["thesis"]) == []


@pytest.mark.parametrize(
    ("setting", "names"),
    [
        ("depth.alignmnt=median", "depth.alignmnt"),
        ("depth.alignment=nonsense", "affine_inverse"),
        ("depth=median", "depth.NAME"),
        ("depth.alignment.mode=median", "'depth.alignment' is a single setting; try depth.alignment=VALUE"),
        ("depth.crop=7", "true, false"),
        ("depth.input_width_px=320", "only one is set, to 320"),
        ("depth.input_width_px=wide", "not a whole number"),
        ("depth.normalisation=half", "imagenet, unit, bytes"),
        ("node_registration.gate_m=nan", "not finite"),
        ("node_registration.gate_m=-1", "-1.0"),
        ("node_registration.max_iterations=0", "at least 1"),
        ("node_registration.max_iterations=2.5", "is not a whole number in digits; try"),
        ("node_registration.max_iterations=1e2", "is not a whole number in digits; try"),
        ("node_registration.gate_m=wide", "is not a number"),
        ("node_registration.sigma_decay=1", "between 0.5 and 0.95"),
        ("surface.radii_m=0.1,-0.2", "-0.2"),
        ("surface.radius_rule=manual", "radii_m"),
        ("surface", "key=value"),
    ],
)
def test_a_wrong_setting_is_one_sentence_that_names_it(setting, names):
    with pytest.raises(InputError) as error:
        with_settings(DEFAULT, [setting])
    assert names in str(error.value)
    assert "\n" not in str(error.value)


def test_a_setting_does_not_hide_a_wrong_one_below_it():
    with pytest.raises(InputError, match=r"'surface\.max_points' is a single setting"):
        with_settings(DEFAULT, ["surface.max_points=5000", "surface.max_points.foo=3"])


def test_a_written_config_file_is_a_preset(tmp_path):
    file = tmp_path / "config.json"
    write_json(file, {"scene": "office", "preset": "thesis", "settings": settings(PRESETS["thesis"])})
    assert config_named(str(file), PRESETS) == PRESETS["thesis"]


@pytest.mark.parametrize(
    "content", ["", "[1]", "{", json.dumps({"settings": {"depth.x": "1"}}), '{"settings": 3}']
)
def test_a_broken_config_file_is_one_sentence(tmp_path, content):
    file = tmp_path / "config.json"
    file.write_text(content)
    with pytest.raises(InputError):
        config_named(str(file), PRESETS)


def test_an_unknown_preset_names_the_known_ones():
    with pytest.raises(InputError, match="thesis or packetmesh"):
        config_named("thesiss", PRESETS)


def test_any_config_takes_settings():
    config = with_settings(NetworkConfig(), ["mac.rts=true", "scenario=street-grid", "mac.kind=ieee80211b"])
    assert config.mac.rts
    assert config.scenario == "street-grid"
    assert with_settings(NetworkConfig(), differences(config, NetworkConfig())) == config


@pytest.mark.parametrize(
    ("setting", "offered"),
    [
        ("mac.rtss=true", "try mac.rts"),
        ("rts=true", "try mac.rts"),
        ("nodes.rts=true", "try mac.rts"),
        ("radoi.range_m=3", "try radio.range_m"),
        ("intervall_s=3", "nodes.interval_s"),
        ("nodes.zzz=3", "nodes.count"),
        ("qqq=3", "scenario"),
    ],
)
def test_an_unknown_setting_offers_the_nearest(setting, offered):
    with pytest.raises(InputError) as error:
        with_settings(NetworkConfig(), [setting])
    assert setting.partition("=")[0] in str(error.value)
    assert offered in str(error.value)


def test_an_unknown_preset_offers_the_nearest_first():
    with pytest.raises(InputError, match="'steet-grid'; try street-grid or"):
        config_named("steet-grid", NETWORKS)


def test_a_written_network_config_is_a_preset(tmp_path):
    write_json(tmp_path / "config.json", {"settings": settings(NETWORKS["greenhouse"])})
    assert config_named(str(tmp_path / "config.json"), NETWORKS) == NETWORKS["greenhouse"]
