"""What the Network screen makes of a run: pieces, pictures, texts, curves, commands. The trace is by hand."""

import inspect
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

import pipeline.delivery
from app.cli.deliver import deliver as command
from app.compute.state import Sent, Spec
from app.drawing.curves import polyline
from app.screens.network.draw import Flights, ground_of
from app.screens.network.job import network_job
from app.screens.network.labels import ACCESS, CODINGS, NETWORKS, REQUESTABLE, SCHEMES, ways
from app.screens.network.lesson import NetworkLook
from app.screens.network.numbers import metric_tables, runs_summary, value_text
from app.screens.network.run_view import run_view
from app.screens.network.view import What
from network_sim.config import NetworkConfig, RunConfig
from network_sim.metrics.metrics import Metric
from network_sim.presets import PRESETS
from network_sim.trace.log import Recorder
from network_sim.types import Cause, EventKind, PacketKind
from packetmesh.progress import Progress
from packetmesh.progress import drain as end
from packetmesh.settings import with_settings
from pipeline.deliver import deliver
from pipeline.delivery.leaving_out import ONLY_CODING
from pipeline.delivery.sending import DeliverySpec
from pipeline.sources import Demo

MS = 1_000_000
NAMES, ROLES = ("node 1", "node 2", "sink"), ("node", "node", "sink")
PLACES_M = np.array([[20.0, 0.0], [-20.0, 0.0], [0.0, 0.0]])


@pytest.fixture(scope="module")
def view():
    """One image of one packet that collides once and then arrives; a second that is dropped."""
    recorder = Recorder("all", 3)
    add, image = recorder.add, {"packet": 0, "image": 0, "size_bytes": 100}
    add(0, EventKind.CAPTURE, 0, image=0, size_bytes=100)
    add(0, EventKind.ENQUEUE, 0, 2, **image)
    add(2 * MS, EventKind.AIR, 0, 2, duration_ns=4 * MS, **image)
    add(3 * MS, EventKind.CAPTURE, 1, image=1, size_bytes=50)
    add(3 * MS, EventKind.ENQUEUE, 1, 2, packet=1, image=1, size_bytes=50)
    add(6 * MS, EventKind.LOSS, 0, 2, cause=Cause.COLLISION, **image)
    add(10 * MS, EventKind.AIR, 0, 2, duration_ns=4 * MS, **image)
    add(14 * MS, EventKind.DELIVER, 0, 2, **image)
    add(14 * MS, EventKind.RECEIVE, 0, 2, **image)
    add(14 * MS, EventKind.ARRIVE, 0, 2, image=0, size_bytes=100)
    add(14 * MS, EventKind.ACK, 2, 0, packet=0, image=0, size_bytes=11, duration_ns=MS)
    add(18 * MS, EventKind.LOSS, 1, 2, packet=1, image=1, cause=Cause.CHANNEL)
    add(18 * MS, EventKind.DROP, 1, 2, packet=1, image=1, size_bytes=50, cause=Cause.CHANNEL)
    add(19 * MS, EventKind.DOWN, 1, cause=Cause.NODE_DOWN)
    config = NetworkConfig(run=RunConfig(horizon_s=0.02))
    return replace(run_view(recorder.trace(config, NAMES, PLACES_M, 20 * MS, ROLES), 0.1), label="by hand")


def rows(view, what):
    """Node, start and end in ms, and cause of the pieces of a kind."""
    some = view.pieces.where(view.pieces.what == what)
    columns = (some.node, some.start_ns // MS, some.end_ns // MS, some.cause)
    return list(zip(*(column.tolist() for column in columns), strict=True))


def test_pieces_tell_waits_frames_and_why_a_frame_was_not_received(view):
    assert rows(view, What.WAIT) == [(0, 0, 2, 0), (1, 3, 18, 0)]
    assert rows(view, What.AIR) == [(0, 2, 6, Cause.COLLISION), (0, 10, 14, Cause.NONE)]
    assert rows(view, What.ACK) == [(2, 14, 15, 0)]
    assert rows(view, What.LOSS) == [(0, 6, 6, Cause.COLLISION), (1, 18, 18, Cause.CHANNEL)]
    assert rows(view, What.DROP) == [(1, 18, 18, Cause.CHANNEL)]
    assert rows(view, What.DOWN) == [(1, 19, 20, Cause.NODE_DOWN)]
    assert rows(view, What.CAPTURE) == [(0, 0, 0, 0), (1, 3, 3, 0)]
    assert rows(view, What.ARRIVE) == [(0, 14, 14, 0)]
    assert (np.diff(view.pieces.start_ns) >= 0).all()


def test_packets_fly_from_sender_to_receiver_and_losses_are_where_they_happened(view):
    flights, at = Flights.of(view.pieces), np.column_stack([PLACES_M, np.zeros(3)])
    places, colors = flights.packets(3 * MS, 0, at)
    np.testing.assert_allclose(places[:, :2], [[15.0, 0.0]])
    np.testing.assert_array_equal(colors, [[0, 114, 178]])
    assert len(flights.packets(7 * MS, 0, at)[0]) == 0
    slow, _ = flights.packets(7 * MS, 10 * MS, at)
    np.testing.assert_allclose(slow[:, :2], [[10.0, 0.0]])
    lost, _ = flights.losses(6 * MS, MS, at)
    np.testing.assert_allclose(lost[:, :2], [PLACES_M[2]])
    unsent, _ = flights.losses(18 * MS, MS, at)
    np.testing.assert_allclose(unsent[:, :2], [PLACES_M[1]])
    assert len(flights.losses(17 * MS, MS, at)[0]) == 0


def test_the_ground_holds_all_ranges_at_one_scale(view):
    ground = ground_of([view])
    reach_m = view.config.radio.range_m
    assert ground.width / ground.scale == pytest.approx(2 * reach_m + 40.0)
    assert ground.depth / ground.scale == pytest.approx(2 * reach_m)
    two = ground_of([view, view])
    assert two.offset(1) - two.offset(0) > two.width


def test_curves_agree_with_the_events(view):
    series = view.series
    assert np.nansum(series["throughput"].values) * 0.02 / 60 == pytest.approx(0.8)
    np.testing.assert_allclose(np.nanmax(series["delay"].values), 0.014)
    assert sorted(series["delivery"].values[np.isfinite(series["delivery"].values)]) == [0.0, 100.0]
    energy = view.config.energy
    sent_s, slept_s, all_s = 0.008, 0.001, 0.04
    received_s = 0.001
    expected_j = sent_s * energy.tx_w + slept_s * energy.sleep_w + received_s * energy.rx_w
    expected_j += (all_s - sent_s - slept_s - received_s) * energy.idle_w
    assert series["energy"].values[-1] == pytest.approx(expected_j)
    line = polyline(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, 2.0]), np.array([1.0, np.nan, 3.0]))
    np.testing.assert_array_equal(line, [1.0, 2.0, 3.0, np.nan])


def test_numbers_have_units_and_definitions(view):
    first, others = metric_tables([view, view])
    assert first.count("by hand</th>") == 2
    assert "Packet delivery ratio" in first
    assert 'data-hint="' in first
    assert "Attempts lost to a busy channel" in others
    assert value_text("packet_delay_mean", None) == "–"
    assert value_text("packet_delay_mean", Metric(0.00137, "s", "")) == "1.37 ms"
    assert "0.0 s of the network's time" in runs_summary([view]).unescape()
    assert all(metric.unit and metric.definition for metric in view.metrics.values())


def test_a_summary_of_two_runs_names_each_in_bold_as_it_is_written(view):
    said = runs_summary([replace(view, label="PDC"), replace(view, label="<b>a*b")])
    assert said.startswith("**PDC**: 0.0 s of the network")
    assert " **&lt;b&gt;a&#42;b**: 0.0 s of the network" in said


@pytest.mark.parametrize("preset", NETWORKS)
def test_every_preset_can_be_run_in_every_way_that_is_offered(preset):
    config = with_settings(PRESETS[preset], NETWORKS[preset].settings)
    offered = ways(preset)
    assert set(offered) <= set(SCHEMES if NETWORKS[preset].street else ACCESS)
    assert with_settings(config, next(iter(offered.values()))) == config
    assert len({with_settings(config, settings) for settings in offered.values()}) == len(offered)


def test_the_codings_offered_are_those_that_there_are():
    assert {name: coding.title for name, coding in pipeline.delivery.CODINGS.items()} == dict(CODINGS)
    assert REQUESTABLE == ONLY_CODING


def test_the_command_the_interface_the_screen_and_its_lessons_have_one_default_coding():
    by_function = [inspect.signature(one).parameters["coding"].default for one in (command, deliver)]
    by_record = [
        field.default
        for record in (DeliverySpec, Sent, NetworkLook)
        for field in fields(record)
        if field.name == "coding"
    ]
    assert [*by_function, *by_record] == 5 * ["exact"]


def test_two_runs_are_simulated_with_progress_and_remembered(store):
    config = with_settings(NetworkConfig(), ("nodes.image_bytes=2000", "run.horizon_s=60"))
    spec = Spec(Demo("office"), networks=(config, with_settings(config, ("run.seed=1",))))
    steps = list(network_job(store, spec))
    assert all(isinstance(progress, Progress) for progress in steps)
    fractions = [progress.fraction for progress in steps]
    assert fractions == sorted(fractions)
    assert fractions[-1] <= 1.0
    one, other = end(network_job(store, spec))
    assert (one.config.run.seed, other.config.run.seed) == (0, 1)
    assert list(network_job(store, replace(spec, networks=spec.networks[1:]))) == []
    assert {PacketKind(int(kind)) for kind in one.pieces.carries} == {PacketKind.IMAGE}


def test_a_run_without_a_log_has_numbers_and_says_that_nothing_is_drawn(store):
    config = with_settings(NetworkConfig(), ("nodes.image_bytes=2000", "run.keep=counters"))
    (view,) = end(network_job(store, Spec(Demo("office"), networks=(config,))))
    assert len(view.pieces) == 0
    assert "no event was kept" in runs_summary([view])
    assert "Image delivery ratio" in metric_tables([view])[0]


def test_the_serving_process_needs_no_simulator():
    code = "import sys, app.server; print([m for m in ('simpy', 'scipy') if m in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
