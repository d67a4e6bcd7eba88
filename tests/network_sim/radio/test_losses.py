"""Losses that are set: their share, the length of their bursts, and that they change nothing else."""

from itertools import islice

import numpy as np
import pytest
from scipy import stats

from network_sim.config import LossConfig, NetworkConfig
from network_sim.metrics.metrics import metrics
from network_sim.presets import PRESETS
from network_sim.radio.losses import LinkLosses, frames_lost
from network_sim.simulate import simulate
from network_sim.trace.conservation import balance, image_balance
from network_sim.trace.log import NetworkTrace
from network_sim.types import Cause, EventKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings

ONE_NODE = ["nodes.count=1", "nodes.image_bytes=232000"]
ALONE = [*ONE_NODE, "nodes.retransmit=false", "mac.ack=false"]
"""2,000 packets, each of them one frame."""


def run(*changes: str) -> NetworkTrace:
    return simulate(with_settings(NetworkConfig(), list(changes)))


def runs_of(lost: np.ndarray) -> np.ndarray:
    """Lengths of the runs of lost frames."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], lost, [False])).astype(int)))
    return edges[1::2] - edges[::2]


def losses(share: float, burst: float, count: int = 200_000, seed: int = 0) -> np.ndarray:
    chain = frames_lost(LossConfig(share, burst), np.random.default_rng(seed))
    return np.array(list(islice(chain, count)))


@pytest.mark.parametrize("burst", [1.0, 8.0])
@pytest.mark.parametrize("share", [0.005, 0.05, 0.25, 0.5])
def test_share_and_mean_burst_are_those_asked_for(share, burst):
    parts = [losses(share, burst, seed=seed) for seed in range(8)]
    for found, wanted in (
        ([part.mean() for part in parts], share),
        ([runs_of(part).mean() for part in parts], max(burst, 1.0 / (1.0 - share))),
    ):
        half = stats.t.ppf(0.9995, len(parts) - 1) * np.std(found, ddof=1) / np.sqrt(len(parts))
        assert abs(np.mean(found) - wanted) <= half
        assert half < 0.3 * wanted


def test_lengths_of_bursts_are_geometric():
    lengths = runs_of(losses(0.1, 4.0))
    for longest in (1, 2, 4, 8, 16):
        longer = stats.binomtest(int((lengths > longest).sum()), len(lengths), 0.75**longest)
        assert longer.pvalue > 1e-3


def test_without_bursts_a_loss_says_nothing_of_the_next():
    lost = losses(0.3, 1.0)
    after = lost[1:][lost[:-1]]
    assert stats.binomtest(int(after.sum()), len(after), 0.3).pvalue > 1e-3


@pytest.mark.parametrize(("share", "lost"), [(0.0, False), (1.0, True)])
def test_limits_of_the_share(share, lost):
    links = LinkLosses(LossConfig(share, 3.0), 0)
    assert {links.lost(0, 1) for _ in range(100)} == {lost}


def test_what_a_link_loses_does_not_depend_on_other_links():
    config = LossConfig(0.3, 4.0)
    alone, among = LinkLosses(config, 5), LinkLosses(config, 5)
    seen = []
    for _ in range(500):
        among.lost(2, 1)
        seen.append(among.lost(0, 1))
    assert seen == [alone.lost(0, 1) for _ in range(500)]
    assert seen != [alone.lost(1, 0) for _ in range(500)]
    other = LinkLosses(config, 6)
    assert seen != [other.lost(0, 1) for _ in range(500)]


@pytest.mark.parametrize("kind", ["ieee802154", "ideal", "serial"])
def test_a_link_loses_its_share_of_packets_that_are_sent_once(kind):
    trace = run(*ALONE, f"mac.kind={kind}", "loss.share=0.1")
    dropped = trace.events.of(EventKind.DROP)
    assert set(dropped.cause.tolist()) == {Cause.LINK}
    assert stats.binomtest(len(dropped), 2000, 0.1).pvalue > 1e-3
    lost = trace.events.of(EventKind.LOSS)
    assert lost.packet.tolist() == dropped.packet.tolist()
    assert image_balance(trace).dropped == {Cause.LINK: 1}


def test_acknowledged_frames_are_lost_at_their_share_and_sent_again():
    for kind, attempts in (("ieee802154", 4), ("ieee80211b", 7)):
        trace = run(*ONE_NODE, f"mac.kind={kind}", "loss.share=0.5", "nodes.retransmit=false")
        frames, lost = len(trace.events.of(EventKind.AIR)), trace.events.of(EventKind.LOSS)
        assert set(lost.cause.tolist()) == {Cause.LINK}
        assert stats.binomtest(len(lost), frames, 0.5).pvalue > 1e-3
        given_up = balance(trace).dropped[Cause.RETRIES]
        assert stats.binomtest(given_up, 2000, 0.5**attempts).pvalue > 1e-3


def test_the_medium_names_its_own_losses_first():
    everything = run("loss.share=1", "run.horizon_s=2", "nodes.images=1")
    causes = everything.events.of(EventKind.LOSS).cause
    assert {Cause.COLLISION, Cause.LINK, Cause.CHANNEL} <= set(causes.tolist())
    assert metrics(everything)["attempts_lost_link"].value == np.count_nonzero(causes == Cause.LINK)
    assert balance(everything).received == 0


def test_an_image_arrives_whole_through_losses_when_it_is_sent_again():
    for kind in ("ieee802154", "ideal"):
        trace = run(*ONE_NODE, f"mac.kind={kind}", "loss.share=0.25", "loss.burst_packets=8")
        assert image_balance(trace).received == 1


@pytest.mark.parametrize(
    ("change", "names"),
    [
        ("loss.share=1.1", "loss.share"),
        ("loss.share=-0.1", "between 0.0 and 1"),
        ("loss.burst_packets=0.5", "at least 1"),
    ],
)
def test_impossible_losses_are_one_sentence(change, names):
    with pytest.raises(InputError, match=names):
        with_settings(NetworkConfig(), [change])


@pytest.mark.parametrize(
    ("preset", "changes"),
    [
        ("thesis-link", ["run.horizon_s=5"]),
        ("thesis-link", ["run.horizon_s=5", "mac.kind=ideal"]),
        ("street-grid", ["run.horizon_s=200", "run.warmup_s=60", "street.vehicles=20", "run.keep=all"]),
        ("greenhouse", ["run.horizon_s=300"]),
        ("office", ["run.horizon_s=12", "uplink.loss=0.1"]),
    ],
)
def test_drawing_losses_changes_nothing_else_that_is_drawn(preset, changes):
    """So small a share is drawn for every frame, and loses none of them."""
    without, drawn = (
        simulate(with_settings(PRESETS[preset], [*changes, f"loss.share={share}"])) for share in (0.0, 1e-15)
    )
    assert len(without.events) > 500
    for one, other in zip(without.events.columns(), drawn.events.columns(), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("kind", "retries", "frames"),
    [("ieee802154", None, 4), ("ieee802154", 0, 1), ("ieee80211b", None, 7), ("ieee80211b", 2, 3)],
)
def test_a_packet_is_given_up_after_as_many_retries_as_are_set(kind, retries, frames):
    changes = () if retries is None else (f"mac.retries={retries}",)
    trace = run(*ONE_NODE, "nodes.retransmit=false", f"mac.kind={kind}", "loss.share=0.6", *changes)
    dropped = trace.events.of(EventKind.DROP)
    dropped = dropped.where(np.isin(dropped.cause, (Cause.RETRIES, Cause.ACK_LOST)))
    sent = np.bincount(trace.events.of(EventKind.AIR).packet)
    assert len(dropped) > 20
    assert (sent[dropped.packet] == frames).all()
    assert sent.max() == frames
