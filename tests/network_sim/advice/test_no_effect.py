"""Every setting of every preset changes the run, or a sentence says why not."""

from __future__ import annotations

import typing
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from network_sim.advice.no_effect import without_effect
from network_sim.config import NetworkConfig
from network_sim.metrics.metrics import metrics
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.trace.log import NetworkTrace
from packetmesh.errors import InputError
from packetmesh.settings import key_of, settings, with_settings

RELAYED = ["nodes.layout=line", "nodes.spacing_m=90", "nodes.count=4", "nodes.images=0"]
"""Relays, hidden nodes, and links near the end of their range."""
SMALL = [*RELAYED, "nodes.image_bytes=3000", "nodes.buffer_packets=12", "run.horizon_s=4"]
LARGE = [
    *(*RELAYED, "nodes.interval_s=0.7", "nodes.image_bytes=20000", "nodes.depth_bytes=9000"),
    *("nodes.deadline_s=2", "run.horizon_s=4"),
]
WIFI = [
    *("nodes.layout=line", "nodes.count=5", "nodes.images=0", "nodes.interval_s=0.2"),
    *("nodes.image_bytes=40000", "nodes.depth_bytes=9000", "nodes.deadline_s=0.3", "run.horizon_s=1.2"),
    *("radio.shadowing_db=2", "radio.capture_db=6", "nodes.duty_period_s=1"),
]
LOSSY = ["loss.share=0.3", "mac.retries=1", "mac.ampdu_packets=1"]
STREET = [
    *("run.horizon_s=24", "run.warmup_s=5", "street.vehicles=40", "street.blocks=2"),
    *("scheme.image_bytes=6000", "scheme.summary_interval_s=2"),
]
STAR = [
    *("nodes.layout=line", "nodes.spacing_m=15", "nodes.images=0", "nodes.interval_s=0.7"),
    *("nodes.count=3", "nodes.image_bytes=12000", "nodes.depth_bytes=9000", "nodes.deadline_s=2"),
    "run.horizon_s=4",
]
CROWDED = [
    *("nodes.count=20", "nodes.image_bytes=300", "nodes.depth_bytes=100", "nodes.interval_s=100"),
    *("nodes.deadline_s=95", "run.horizon_s=600", "nodes.spacing_m=50", "radio.shadowing_db=3"),
]
WALLS = ["radio.walls_m=40,-9,40,9", "radio.wall_db=1", "nodes.spacing_m=80", "radio.noise_dbm=-72"]
OFTEN = ["scheme.control_s=4", "scheme.observation_s=12", "scheme.r_low=0.8", "scheme.r_high=1.4"]
CASES = {
    "thesis-link": ("thesis-link", [*SMALL, "radio.capture_db=13"]),
    "greenhouse": (
        "greenhouse",
        [
            "nodes.interval_s=12",
            "nodes.deadline_s=9",
            "nodes.count=4",
            "nodes.duty_period_s=4",
            "run.horizon_s=30",
        ],
    ),
    "office": ("office", LARGE),
    "street-grid": ("street-grid", STREET),
    "serial": ("thesis-link", [*SMALL, "mac.kind=serial"]),
    "ideal": ("thesis-link", [*SMALL, "mac.kind=ideal"]),
    "recorded": ("thesis-link", [*SMALL, "mac.kind=replay", "mac.trace=LINK"]),
    "without acknowledgements": ("thesis-link", [*SMALL, "radio.capture_db=13", "mac.ack=false"]),
    "a single node": ("thesis-link", [*SMALL, "nodes.count=1", "loss.share=0.3"]),
    "lossy": ("office", [*LARGE, "loss.share=0.3", "nodes.duty_cycle=0.5", "nodes.duty_period_s=1.5"]),
    "log-distance": ("office", [*LARGE, "radio.model=log-distance"]),
    "friis": ("office", [*LARGE, "radio.model=friis", *WALLS]),
    "wifi-n, lossy": (
        "wifi-n",
        [*WIFI, *LOSSY, "nodes.spacing_m=18", "nodes.image_bytes=15000"],
    ),
    "wifi-ax": (
        "wifi-ax",
        [*WIFI, "nodes.spacing_m=8", "radio.noise_dbm=-84", "radio.sense_range_m=14"],
    ),
    "wifi-ah": (
        "wifi-ah",
        [*WIFI, "nodes.spacing_m=90", "nodes.interval_s=1", "run.horizon_s=4", "nodes.deadline_s=0.9"],
    ),
    "lora": ("lora", [*STAR, *CROWDED]),
    "lora with noise and acknowledgements": (
        "lora",
        [*STAR, *CROWDED, "mac.ack=true", "mac.retries=1", "radio.noise_dbm=-117", "radio.nakagami_m=1"],
    ),
    "ble": ("ble", STAR),
    "ble, fading": ("ble", [*STAR, "radio.nakagami_m=2", "loss.share=0.1"]),
    "lte-m": ("lte-m", [*STAR, "loss.share=0.3", "mac.retries=1"]),
    "nb-iot": ("nb-iot", [*STAR, "loss.share=0", "nodes.deadline_s=none"]),
    "recorded uplink": ("office", [*LARGE, "uplink.trace=LINK"]),
    "greedy": ("street-grid", [*STREET, "scheme.name=greedy"]),
    "pdc": ("street-grid", [*STREET, "scheme.name=pdc", *OFTEN]),
    "pdc-received": ("street-grid", [*STREET, "scheme.name=pdc-received", "run.keep=counters", *OFTEN]),
}
VALUES = {
    "mac.spreading_factor": ["8"],
    "mac.connection_interval_s": ["0.1"],
    "mac.tones": ["3"],
    "mac.rate_bps": ["2e6"],
    "mac.mcs": ["3"],
    "mac.guard_us": ["0.4", "1.6"],
    "mac.bandwidth_hz": ["1e6"],
    "mac.ampdu_packets": ["3"],
    "mac.ampdu_bytes": ["5000"],
    "mac.trace": ["SLOWER"],
    "uplink.trace": ["SLOWER"],
    "radio.walls_m": ["130,-9,130,9", "-20,-10,420,430"],
    "mac.retries": ["0"],
    "radio.noise_dbm": ["-65"],
    "nodes.deadline_s": ["0.05"],
    "scheme.buffer_images": ["3"],
    "scheme.datagram_bytes": ["800"],
    "nodes.payload_bytes": ["100"],
    "nodes.failures_per_h": ["900"],
    "nodes.buffer_packets": ["3"],
    "nodes.image_times_s": ["0.5"],
    "nodes.bytes_by_image": ["900"],
}
"""Other values of settings whose type does not suggest them."""
REFUSED = (
    *("scenario", "mac.kind", "nodes.first_bytes_by_node", "nodes.request_bytes_by_node"),
    *("nodes.image_times_s", "nodes.bytes_by_image"),
)
"""Settings whose other values need further settings, which the refusal names."""
ROWS = [(0.1 * row, 0.05 + 0.01 * (row % 7), 20 + row % 5, 0.02 * (row % 3)) for row in range(40)]


def hints(config: Any, prefix: str = "") -> dict[str, Any]:
    """The type of every setting."""
    found: dict[str, Any] = {}
    of = typing.get_type_hints(type(config))
    for field in fields(config):
        value = getattr(config, field.name)
        inner = is_dataclass(value)
        found |= hints(value, f"{prefix}{field.name}.") if inner else {prefix + field.name: of[field.name]}
    return found


HINTS = hints(NetworkConfig())


def others(key: str, value: str, config: NetworkConfig) -> list[str]:
    """Other values of a setting, by its type."""
    kind, count = HINTS[key], config.nodes.count
    if key in VALUES:
        return VALUES[key]
    if key.endswith("bytes_by_node"):
        return [",".join(str(400 * (node + 1)) for node in range(count))]
    if key == "nodes.places_m":
        return [",".join(f"{70 * node},{node}" for node in range(count + 1))]
    if typing.get_origin(kind) is Literal:
        return [other for other in typing.get_args(kind) if other != value]
    if kind is bool:
        return ["false" if value == "true" else "true"]
    if value == "none":
        return ["2"]
    if kind is int or int in typing.get_args(kind):
        return [str(2 * int(value) + 1)]
    number = float(value)
    return [str(other) for other in (2.0 * number + 1.0, 0.4 * number) if other != number]


def fingerprint(trace: NetworkTrace) -> list[Any]:
    events = b"".join(np.ascontiguousarray(column).tobytes() for column in trace.events.columns())
    return [events, {name: metric.value for name, metric in metrics(trace).items()}]


@pytest.fixture(scope="module")
def links(tmp_path_factory):
    """Two recorded links."""
    folder = tmp_path_factory.mktemp("links")
    for name, factor in (("LINK", 1.0), ("SLOWER", 0.6)):
        (folder / name).write_text(
            "".join(f"{t} {factor * rate} {rtt} {loss}\n" for t, rate, rtt, loss in ROWS)
        )
    return folder


def filled(change: str, links: Path) -> str:
    """A change with the paths of the recorded links."""
    return change.replace("=LINK", f"={links / 'LINK'}").replace("=SLOWER", f"={links / 'SLOWER'}")


def outcome(base: NetworkConfig, change: str, was: list[Any]) -> str:
    """Return whether a change is refused, said to change nothing, or differs; "nothing" if it is silent."""
    key = key_of(change)
    try:
        changed = with_settings(base, [change])
    except InputError:
        return "refused"
    said, now = without_effect(changed, [key], base), fingerprint(simulate(changed))
    if not said:
        return "nothing" if now == was else "differs"
    assert now == was, f"{said[0]}, and yet it does"
    assert said[0].startswith(f"{key} changes nothing here: ")
    return "said"


@pytest.mark.parametrize("case", CASES)
def test_every_setting_changes_the_run_or_is_said_to_change_nothing(case, links):
    preset, changes = CASES[case]
    base = with_settings(PRESETS[preset], [filled(change, links) for change in changes])
    was, silent = fingerprint(simulate(base)), []
    for key, value in settings(base).items():
        changes = [filled(f"{key}={other}", links) for other in others(key, value, base)]
        found = {change: outcome(base, change, was) for change in changes}
        counts = {"said", "differs", "refused"} if key in REFUSED else {"said", "differs"}
        if not counts.intersection(found.values()):
            silent.append(found)
    assert not silent


@pytest.mark.parametrize(
    ("preset", "changes", "said"),
    [
        (
            "street-grid",
            ["scheme.name=pdc", "run.horizon_s=50", "run.warmup_s=0", "scheme.r_low=2"],
            "first prob",
        ),
        ("street-grid", ["scheme.name=greedy", "scheme.r_low=2"], "scheme.name is greedy, and only pdc"),
        ("thesis-link", ["radio.capture_db=3"], "as with radio.capture_db=none, the same nodes receive"),
        ("thesis-link", ["nodes.duty_period_s=3"], "nodes never sleep"),
        ("office", ["mac.ack=false"], "always acknowledges"),
        ("greenhouse", ["mac.rate_bps=1e6"], "only ieee80211b uses it"),
        ("office", ["nodes.deadline_s=900"], "before an image can be that old"),
    ],
)
def test_the_reason_is_the_one_that_a_user_can_act_on(preset, changes, said):
    config = with_settings(PRESETS[preset], changes)
    (sentence,) = without_effect(config, [key_of(changes[-1])], PRESETS[preset])
    assert said in sentence


def test_without_places_no_links_are_compared_and_unknown_keys_are_left_out():
    config = with_settings(PRESETS["thesis-link"], ["radio.range_m=120"])
    assert len(without_effect(config, ["radio.range_m"], PRESETS["thesis-link"])) == 1
    assert without_effect(config, ["radio.range_m", "radio.unknown"]) == []
