"""Settings that change nothing in a run, with the reason: the radio, the scheme or another setting.

``without_effect`` is for settings that a user gave. Most reasons follow from the config alone. A setting of
the radio or of the nodes' places may also leave all links as they were; to find this, the links are compared.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from network_sim.config import ANY_DISTANCE, OFDM_KINDS, STARS, WLAN_KINDS, MacKind, NetworkConfig
from network_sim.settings.mac import GUARDS_US
from packetmesh.settings import settings, with_settings

if TYPE_CHECKING:
    from network_sim.radio.propagation import Radio

CHANNELS = ("ieee802154", *WLAN_KINDS, "lora")
"""Medium accesses whose nodes share a channel."""
CELLULAR = ("lte-m", "nb-iot")
_OWN: dict[str, MacKind] = {
    "mac.rate_bps": "ieee80211b",
    "mac.bandwidth_hz": "ieee80211ah",
    "mac.spreading_factor": "lora",
    "mac.connection_interval_s": "ble",
    "mac.full_duplex": "lte-m",
    "mac.tones": "nb-iot",
}
"""Settings that a single medium access uses."""
_POWER = ("radio.tx_power_dbm", "radio.antenna_gain", "radio.system_loss")
_POWER_LAW = ("radio.path_loss_exponent", "radio.reference_m")
_PLACES = ("nodes.layout", "nodes.spacing_m", "nodes.places_m")
_PDC = ("scheme.r_low", "scheme.r_high", "scheme.observation_s", "scheme.control_s")
_EQUAL_RTOL = 1e-9
"""Relative difference below which two links are equal."""
Reasons = Iterator[tuple[Iterable[str], str]]
"""Keys of settings, and why they change nothing."""


def without_effect(
    config: NetworkConfig, keys: Iterable[str], before: NetworkConfig | None = None
) -> list[str]:
    """Return one sentence for each setting that changes nothing in the runs of a config.

    Args:
        config: the config, with the settings.
        keys: settings that the user gave, such as ``"radio.capture_db"``; unknown ones are left out.
        before: the config without them, with which the links are compared; None if the nodes will have other
            places than in the config.
    """
    reasons, sentences = idle_settings(config), []
    for key in dict.fromkeys(keys):
        reason = reasons.get(key) or (None if before is None else _same_links(config, key, before))
        if reason is not None:
            sentences.append(f"{key} changes nothing here: {reason}")
    return sentences


def idle_settings(config: NetworkConfig) -> dict[str, str]:
    """Return the reason for each setting whose value no run of this config uses."""
    street = config.scenario == "street-grid"
    groups = (
        _of_medium_access(config),
        _of_radio(config),
        _of_street(config) if street else _of_nodes(config),
    )
    reasons: dict[str, str] = {}
    for group in groups:
        for keys, reason in group:
            for key in keys:
                reasons.setdefault(key, reason)
    return reasons


def _of_medium_access(config: NetworkConfig) -> Reasons:
    mac, loss = config.mac, config.loss
    kind = f"mac.kind is {mac.kind}"
    if mac.kind not in WLAN_KINDS:
        yield ("mac.rts",), f"{kind}, and only {_names(WLAN_KINDS)} use it"
    if mac.kind not in OFDM_KINDS:
        yield (
            ("mac.mcs", "mac.ampdu_packets", "mac.ampdu_bytes"),
            f"{kind}, and only {_names(OFDM_KINDS)} use it",
        )
    elif mac.ampdu_packets == 1:
        yield ("mac.ampdu_bytes",), "mac.ampdu_packets is 1, so a frame has one packet whatever its size"
    if mac.kind not in GUARDS_US:
        yield ("mac.guard_us",), f"{kind}, and only {_names(tuple(GUARDS_US))} use it"
    for key, only in _OWN.items():
        if mac.kind != only:
            yield (key,), f"{kind}, and only {only} uses it"
    if mac.kind not in ("ieee802154", "replay", "lora"):
        without = mac.kind in ("ideal", "serial")
        yield (
            ("mac.ack",),
            f"{kind}, which {'needs no acknowledgements' if without else 'always acknowledges'}",
        )
    if mac.kind == "ble":
        yield ("mac.retries",), f"{kind}, which repeats a frame until it arrives"
    elif mac.kind not in (*CHANNELS, *CELLULAR):
        yield ("mac.retries",), f"{kind}, which sends each packet once"
    elif mac.kind in CELLULAR and not loss.share:
        yield ("mac.retries",), "loss.share is 0, so every block arrives"
    elif mac.kind in ("ieee802154", "lora") and not mac.ack:
        yield ("mac.retries",), "mac.ack is false, so no sender learns that a frame was lost"
    if mac.kind not in ("ideal", "serial"):
        yield ("mac.link_bps",), f"{kind}, and only ideal and serial use it"
    if mac.kind != "replay":
        yield ("mac.trace",), f"{kind}, and only replay reads a recorded link"
    if not 0.0 < loss.share < 1.0:
        yield ("loss.burst_packets",), f"loss.share is {loss.share:g}, which leaves no bursts to form"
    elif loss.burst_packets <= 1.0 / (1.0 - loss.share):
        shortest = f"independent losses of loss.share {loss.share:g} already have longer bursts"
        yield ("loss.burst_packets",), f"{shortest}; try more than {1.0 / (1.0 - loss.share):.3g}"


def _names(kinds: Sequence[str]) -> str:
    """Return the names as part of a sentence."""
    return f"{', '.join(kinds[:-1])} and {kinds[-1]}"


def _of_radio(config: NetworkConfig) -> Reasons:
    radio, kind = config.radio, config.mac.kind
    street, every = config.scenario == "street-grid", settings(radio, "radio.")
    if kind in ("serial", "replay") and not street:
        yield every, f"mac.kind is {kind}, which gives every node a line of its own"
    if kind in CELLULAR:
        yield (
            every,
            f"mac.kind is {kind}, whose base station covers all nodes; loss.share sets what gets lost",
        )
    if kind == "ble":
        apart = "mac.kind is ble, whose connection events never overlap"
        yield ("radio.sense_range_m", "radio.capture_db", "radio.noise_dbm"), apart
    if kind == "lora":
        yield ("radio.sense_range_m",), "mac.kind is lora, whose nodes listen to nobody before they send"
    if kind in ("ideal", "serial") and street:
        contact = "vehicle within radio.range_m a link of its own"
        yield (
            [key for key in every if key != "radio.range_m"],
            f"mac.kind is {kind}, which gives every {contact}",
        )
    if kind == "ideal":
        unused = ("radio.sense_range_m", "radio.capture_db", "radio.noise_dbm", "radio.nakagami_m")
        yield unused, "mac.kind is ideal: within range every frame arrives"
    if radio.model != "two-ray":
        yield ("radio.antenna_height_m",), f"radio.model is {radio.model}, and only two-ray uses it"
    if radio.model != "log-distance":
        yield _POWER_LAW, f"radio.model is {radio.model}, and only log-distance uses it"
    if not radio.walls_m:
        yield ("radio.wall_db",), "radio.walls_m has no wall"
    if radio.noise_dbm is None or kind not in CHANNELS:
        relative = "radio.range_m sets the receive threshold, and all powers change with it"
        remedy = "; change radio.range_m, or set radio.noise_dbm" if kind in CHANNELS else ""
        yield _POWER, relative + remedy
        if radio.model != "two-ray":
            yield ("radio.frequency_hz",), relative + remedy
    if kind in CHANNELS and not street and config.nodes.count == 1:
        yield (
            ("radio.sense_range_m", "radio.capture_db"),
            "a single node shares its channel with the sink only",
        )


def _of_nodes(config: NetworkConfig) -> Reasons:
    nodes, uplink, kind = config.nodes, config.uplink, config.mac.kind
    vehicles = (*settings(config.scheme, "scheme."), *settings(config.street, "street."))
    yield vehicles, "scenario is collection, which has no vehicles; try scenario=street-grid"
    if nodes.places_m:
        yield ("nodes.layout", "nodes.spacing_m"), "nodes.places_m has the nodes' places"
    if kind in ANY_DISTANCE:
        yield _PLACES, f"mac.kind is {kind}, which connects nodes at any distance; only drawings show it"
    if nodes.bytes_by_node:
        yield ("nodes.image_bytes", "nodes.depth_bytes"), "nodes.bytes_by_node has the size of each image"
    if nodes.image_times_s:
        own = "nodes.image_times_s and nodes.bytes_by_image have the time and the size of each image"
        yield ("nodes.interval_s", "nodes.image_bytes", "nodes.depth_bytes", "nodes.bytes_by_node"), own
    if not nodes.first_bytes_by_node:
        yield ("nodes.request_after_s",), "nodes.first_bytes_by_node is empty, so the sink requests nothing"
    if nodes.duty_cycle == 1.0:
        yield ("nodes.duty_period_s",), "nodes.duty_cycle is 1, so nodes never sleep"
    if not nodes.failures_per_h:
        yield ("nodes.recovery_s",), "nodes.failures_per_h is 0, so nodes never fail"
    if nodes.duty_cycle == 1.0 and not nodes.failures_per_h:
        yield ("energy.sleep_w", "energy.platform_sleep_w"), "no node ever sleeps or fails"
    if nodes.deadline_s is not None and nodes.deadline_s >= config.run.horizon_s:
        yield ("nodes.deadline_s",), "the run stops at run.horizon_s, before an image can be that old"
    if kind in ("serial", "ble", *CELLULAR) and not _loses(config):
        yield ("nodes.retransmit",), "no packet gets lost"
    statuses = nodes.retransmit and kind == "replay" and not config.mac.ack
    requests = statuses or bool(nodes.first_bytes_by_node)
    if kind in ANY_DISTANCE and not nodes.failures_per_h and not requests:
        yield ("energy.rx_w",), "no camera receives anything"
    if kind == "lora" and not config.mac.ack and not nodes.retransmit and not nodes.first_bytes_by_node:
        yield ("energy.rx_w",), "no camera receives anything"
    if uplink.trace is not None:
        yield ("uplink.rate_bps", "uplink.latency_s", "uplink.loss"), "uplink.trace replaces it"
    elif not uplink.exists:
        yield (
            ("uplink.latency_s", "uplink.loss"),
            "there is no uplink without uplink.rate_bps or uplink.trace",
        )


def _loses(config: NetworkConfig) -> bool:
    """Return whether a packet on a link without contention or on the uplink can get lost or late."""
    nodes, uplink = config.nodes, config.uplink
    lossy = (config.loss.share > 0.0 and config.mac.kind != "ble") or (
        uplink.exists and (uplink.loss > 0.0 or uplink.trace is not None)
    )
    return bool(lossy or nodes.failures_per_h or nodes.duty_cycle < 1.0 or nodes.deadline_s is not None)


def _of_street(config: NetworkConfig) -> Reasons:
    scheme, name = config.scheme, f"scheme.name is {config.scheme.name}"
    fixed = (*settings(config.nodes, "nodes."), *settings(config.uplink, "uplink."))
    yield fixed, "scenario is street-grid, whose cameras are in vehicles; try scheme and street"
    yield ("energy.sleep_w", "energy.platform_sleep_w"), "no vehicle ever sleeps or fails"
    if scheme.name not in ("greedy", "worth"):
        yield ("scheme.k",), f"{name}, and only greedy and worth use it"
    if scheme.name != "worth":
        yield ("scheme.piece_header_bytes",), f"{name}, and only worth uses it"
        if config.run.keep == "counters":
            yield ("scheme.pieces",), f"{name}, and with run.keep counters no coverage is measured"
    if scheme.name not in ("pdc", "pdc-received"):
        yield _PDC, f"{name}, and only pdc and pdc-received use it"
    elif scheme.control_s >= config.run.horizon_s:
        yield _PDC[:3], "the run ends before scheme.control_s, when the first probabilities are set"
    if scheme.name == "baseline":
        yield ("scheme.id_bytes",), f"{name}, which sends no requests"
    if config.run.keep == "counters":
        unseen = f"{name} does not use it, and with run.keep counters no coverage is measured"
        if scheme.name == "baseline":
            yield ("scheme.validity_s", "scheme.cell_m", "scheme.directed_cells"), unseen
        elif scheme.name == "pdc-received":
            yield ("scheme.validity_s",), unseen


def _same_links(config: NetworkConfig, key: str, before: NetworkConfig) -> str | None:
    """Return the reason if a setting of radio or places leaves all links of fixed nodes as they were."""
    own, old = settings(config), settings(before)
    if config.scenario != "collection" or not (key.startswith("radio.") or key in _PLACES):
        return None
    if own.get(key) == old.get(key):
        return None
    other = with_settings(config, [f"{key}={old[key]}"])
    links, others = _links(config), _links(other)
    if len(links) != len(others):
        return None
    if any(one.shape != two.shape for one, two in zip(links, others, strict=True)):
        return None
    if not all(np.allclose(*both, rtol=_EQUAL_RTOL, atol=0.0) for both in zip(links, others, strict=True)):
        return None
    without = f"with {key}={old[key]}" if old[key] else "without it"
    return f"as {without}, the same nodes receive and sense each other equally well"


def _links(config: NetworkConfig) -> list[NDArray[np.float64]]:
    """Return the arrays through which radio and places affect a run; equal arrays give equal events."""
    from network_sim.fixed.collection import topology  # here, because the app imports this module

    places, radio, success = topology(config)
    kind = config.mac.kind
    if kind not in CHANNELS and not (kind == "ble" and radio.fades):
        return [success]
    count = places.count
    power_w = np.array(
        [[radio.between_w(places, a, b, 0) if a != b else 0.0 for b in range(count)] for a in range(count)]
    )
    marks = [success]
    if kind not in STARS:  # between other nodes than the sink nothing is received or sensed
        marks += [
            np.asarray(power_w >= least_w, float) for least_w in (radio.rx_threshold_w, radio.cs_threshold_w)
        ]
    return [np.asarray(one, float) for one in (*marks, *_ratios(radio, power_w, config))]


def _ratios(
    radio: Radio, power_w: NDArray[np.float64], config: NetworkConfig
) -> Iterator[NDArray[np.float64]]:
    """Yield the ratios of powers (N, N) that decide about overlapping frames, fading and bit errors."""
    yield np.array([radio.capture_ratio if config.nodes.count > 1 else 0.0])
    strongest_w = power_w.max(axis=0)
    yield power_w / np.where(strongest_w > 0.0, strongest_w, 1.0)
    if config.radio.nakagami_m is not None:
        yield np.array([config.radio.nakagami_m])
        yield power_w / radio.rx_threshold_w
    if radio.noise_w is not None:
        yield power_w / radio.noise_w
