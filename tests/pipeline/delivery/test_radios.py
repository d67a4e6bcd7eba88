"""One rig by every radio: the network that all share, and when its surface is as good as without losses."""

from dataclasses import replace
from math import isfinite

import pytest

from network_sim.config import ANY_DISTANCE
from network_sim.presets import PRESETS
from packetmesh.progress import drain
from pipeline.delivery.moments import Rebuilder
from pipeline.delivery.radios import LONGEST_S, RADIOS, radio_network, reach
from pipeline.delivery.sending import DeliverySpec, send
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from tests.pipeline.delivery.small import CONFIG, small_rig


def spec_of(rig, preset, *, spacing_m=8.0, moments=6):
    network = radio_network(preset)
    network = replace(network, nodes=replace(network.nodes, spacing_m=spacing_m))
    return DeliverySpec(Spec(LoadedRig(rig), config=CONFIG), network, "raw", moments)


def test_every_radio_has_one_preset_and_everything_else_is_equal():
    kinds = [PRESETS[preset].mac.kind for preset in RADIOS]
    assert len(set(kinds)) == len(kinds)
    assert set(kinds) == {network.mac.kind for network in PRESETS.values()}
    networks = [radio_network(preset) for preset in RADIOS]
    for key in ("spacing_m", "deadline_s", "duty_cycle", "failures_per_h", "retransmit", "places_m"):
        assert len({getattr(network.nodes, key) for network in networks}) == 1, key
    assert {network.run.horizon_s for network in networks} == {LONGEST_S}
    assert not any(network.uplink.exists for network in networks)
    for preset, network in zip(RADIOS, networks, strict=True):
        own = PRESETS[preset]
        assert (network.mac, network.radio, network.energy) == (own.mac, own.radio, own.energy)


@pytest.fixture(scope="module")
def rig():
    return small_rig()


def test_the_times_are_those_of_the_moments(rig):
    spec = spec_of(rig, "wifi-n")
    sending = send(spec, rig)
    rebuilder = Rebuilder(sending)
    moments = [drain(rebuilder.moment(index)) for index in range(len(sending.times_ns))]
    scores = [0.0 if moment.truth is None else moment.truth["f_score_5cm"] for moment in moments]
    found = reach("wifi-n", spec, rig, scores[-1])
    almost, whole = (
        next(k for k, score in enumerate(scores) if score >= share * scores[-1]) for share in (0.9, 0.99)
    )
    assert (found.seconds_to_90_s, found.seconds_to_99_s) == (moments[almost].t_s, moments[whole].t_s)
    end = moments[whole]
    assert (found.radio_j, found.energy_j, found.sent_bytes) == (end.radio_j, end.energy_j, end.sent_bytes)
    assert found.delivered_bytes == end.delivered_bytes
    assert found.share == scores[whole] / scores[-1]


def test_a_radio_that_does_not_reach_has_no_times_and_no_bytes(rig):
    found = reach("wifi-ax", spec_of(rig, "wifi-ax", spacing_m=500.0), rig, 0.9)
    assert not isfinite(found.seconds_to_90_s)
    assert not isfinite(found.seconds_to_99_s)
    assert (found.sent_bytes, found.delivered_bytes, found.share) == (0, 0, 0.0)
    assert "lte-m" in ANY_DISTANCE
    assert isfinite(reach("lte-m", spec_of(rig, "lte-m", spacing_m=500.0), rig, None).seconds_to_99_s)


def test_without_a_truth_the_bytes_count(rig):
    blind = replace(rig, truth=None)
    found = reach("wifi-n", spec_of(blind, "wifi-n", moments=10), blind, None)
    assert found.share == 1.0
    assert found.delivered_bytes == found.image_bytes
    assert 0.0 < found.seconds_to_90_s <= found.seconds_to_99_s
