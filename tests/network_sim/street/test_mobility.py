"""Routes, cells and contacts against their definitions, looked at step by step."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from network_sim.config import StreetConfig
from network_sim.street.mobility import (
    STEPS,
    StreetPlaces,
    access_points_m,
    cell_numbers,
    cells_m,
    contacts,
    crossings_m,
    drive,
)
from network_sim.types import NS_PER_S, to_ns
from packetmesh.errors import InputError

HORIZON_S = 1200.0
CONFIG = StreetConfig(vehicles=8, blocks=5)


def _routes(config: StreetConfig = CONFIG, seed: int = 1):
    return drive(config, HORIZON_S, np.random.default_rng(seed))


@pytest.mark.parametrize("blocks", [1, 2, 5])
def test_vehicles_stay_on_the_grid_and_never_turn_back(blocks: int) -> None:
    routes = _routes(StreetConfig(vehicles=20, blocks=blocks))
    points = crossings_m(routes.config)[routes.crossings] / routes.config.block_m
    assert ((points >= 0) & (points <= blocks)).all()
    assert (np.diff(points, axis=1) == STEPS[routes.headings]).all()
    assert ((routes.headings[:, 1:] - routes.headings[:, :-1]) % 4 != 2).all()
    end_m = routes.start_m + HORIZON_S * routes.config.speed_mps
    assert (end_m < routes.headings.shape[1] * routes.config.block_m).all()


def test_turns_are_equally_likely() -> None:
    routes = _routes(StreetConfig(vehicles=200, blocks=5))
    inner = ((crossings_m(routes.config) / 200.0 % 5.0) > 0).all(axis=1)[routes.crossings[:, 1:-1]]
    turns = (routes.headings[:, 1:] - routes.headings[:, :-1])[inner] % 4
    shares = np.bincount(turns, minlength=4) / len(turns)
    assert shares == pytest.approx([1 / 3, 1 / 3, 0, 1 / 3], abs=0.03)


def test_a_vehicle_moves_at_its_speed() -> None:
    places = StreetPlaces(_routes(), access_points_m(CONFIG))
    times_ns = np.arange(0, to_ns(HORIZON_S), to_ns(0.5)).tolist()
    path_m = np.array([places.position_m(3, t_ns) for t_ns in times_ns])
    steps_m = np.abs(np.diff(path_m, axis=0)).sum(axis=1)
    assert steps_m == pytest.approx(np.full(len(steps_m), 5.0), abs=1e-6)


@pytest.mark.parametrize("directed", [True, False])
def test_a_vehicle_is_between_the_ends_of_its_cell(directed: bool) -> None:
    routes = _routes()
    places, ends_m = StreetPlaces(routes, access_points_m(CONFIG)), cells_m(CONFIG, 70.0)
    times_ns = np.arange(0, to_ns(HORIZON_S), to_ns(7.3))
    for vehicle in range(3):
        cells = routes.cells(vehicle, times_ns, 70.0, directed)
        for t_ns, cell in zip(times_ns.tolist(), cells.tolist(), strict=True):
            at_m = np.array(places.position_m(vehicle, t_ns))
            low_m, high_m = np.sort(ends_m[cell], axis=0)
            assert (at_m > low_m - 1e-6).all()
            assert (at_m < high_m + 1e-6).all()
    assert len(ends_m) == cell_numbers(CONFIG, 70.0)


def test_distances_are_those_of_the_positions() -> None:
    places = StreetPlaces(_routes(), access_points_m(CONFIG))
    assert places.count == 12
    assert not places.static
    now_ns = to_ns(77.7)
    here_m, there_m = np.array(places.position_m(2, now_ns)), access_points_m(CONFIG)[1]
    assert places.distance_m(2, 9, now_ns) == pytest.approx(float(np.hypot(*(here_m - there_m))))
    assert places.distance_m(9, 2, now_ns) == places.distance_m(2, 9, now_ns)


@settings(max_examples=15)
@given(seed=st.integers(0, 1000), range_m=st.floats(20.0, 450.0), at_crossings=st.booleans())
def test_contacts_are_the_times_within_range(seed: int, range_m: float, at_crossings: bool) -> None:
    routes = _routes(StreetConfig(vehicles=2, blocks=4, speed_mps=13.0), seed)
    rng = np.random.default_rng(seed)
    points_m = access_points_m(routes.config) if at_crossings else rng.uniform(0.0, 800.0, (3, 2))
    places = StreetPlaces(routes, points_m)
    for vehicle, found in enumerate(contacts(routes, points_m, range_m)):
        for index in range(len(points_m)):
            mine = [contact for contact in found if contact.access_point == index]
            for t_ns in rng.integers(0, to_ns(HORIZON_S), 300).tolist():
                distance_m = places.distance_m(vehicle, 2 + index, t_ns)
                within = any(contact.enter_ns <= t_ns <= contact.leave_ns for contact in mine)
                assert within == (distance_m <= range_m) or distance_m == pytest.approx(range_m, abs=1e-4)
            gaps_ns = [b.enter_ns - a.leave_ns for a, b in pairwise(mine)]
            assert all(gap_ns > 1 for gap_ns in gaps_ns), "what touches is one contact"
            ends_ns = [
                t
                for contact in mine
                for t in (contact.enter_ns, contact.leave_ns)
                if 0 < t < to_ns(HORIZON_S)
            ]
            edges_m = [places.distance_m(vehicle, 2 + index, t_ns) for t_ns in ends_ns]
            assert edges_m == pytest.approx([range_m] * len(edges_m), abs=1e-4)
            assert all(edge_m <= range_m + 1e-9 for edge_m in edges_m)


def test_time_in_range_is_the_share_of_the_streets_in_range() -> None:
    routes = drive(StreetConfig(vehicles=100, blocks=5), 3600.0, np.random.default_rng(2))
    found = contacts(routes, access_points_m(routes.config), 100.0)
    inside_ns = sum(
        min(c.leave_ns, to_ns(3600)) - c.enter_ns for each in found for c in each if c.enter_ns < to_ns(3600)
    )
    assert inside_ns / NS_PER_S / 3600 / 100 == pytest.approx(4 * 400 / (60 * 200), rel=0.05)


def test_cells_are_pieces_of_road_in_one_direction() -> None:
    routes = _routes()
    times_ns = np.arange(0, to_ns(60.0), to_ns(0.5))
    places = StreetPlaces(routes, access_points_m(CONFIG))
    where = {}
    for vehicle in range(8):
        cells = routes.cells(vehicle, times_ns, 100.0)
        assert (cells < cell_numbers(CONFIG, 100.0)).all()
        position_m = [places.position_m(vehicle, t_ns) for t_ns in times_ns.tolist()]
        headings = routes.headings[vehicle, routes.segments(vehicle, times_ns)[0]]
        for cell, heading, (x_m, y_m) in zip(cells.tolist(), headings.tolist(), position_m, strict=True):
            where.setdefault(cell, []).append((heading, x_m, y_m))
        changes = np.flatnonzero(np.diff(cells))
        assert (np.diff(changes) == 20).all(), "100 m at 10 m/s are 10 s"
    for seen in where.values():
        heading, x_m, y_m = np.array(seen).T
        assert np.ptp(heading) == 0
        assert np.ptp(x_m) + np.ptp(y_m) <= 100.0 + 1e-6


def test_undirected_cells_are_shared_by_both_directions() -> None:
    routes = _routes()
    times_ns = np.arange(0, to_ns(600.0), to_ns(0.5))
    places = StreetPlaces(routes, access_points_m(CONFIG))
    where = {}
    for vehicle in range(8):
        cells = routes.cells(vehicle, times_ns, 100.0, directed=False)
        headings = routes.headings[vehicle, routes.segments(vehicle, times_ns)[0]]
        for cell, heading, t_ns in zip(cells.tolist(), headings.tolist(), times_ns.tolist(), strict=True):
            where.setdefault(cell, []).append((heading, *places.position_m(vehicle, t_ns)))
    both = 0
    for seen in where.values():
        heading, x_m, y_m = np.array(seen).T
        assert np.ptp(x_m) + np.ptp(y_m) <= 100.0 + 1e-6
        assert len(np.unique(heading % 2)) == 1
        both += len(np.unique(heading)) == 2
    assert both > 20
    assert len(where) <= 60 * 2, "60 blocks of road with two cells each"


def test_a_cell_longer_than_a_block_is_the_block() -> None:
    routes = _routes()
    times_ns = np.arange(0, to_ns(100.0), to_ns(1.0))
    assert (routes.cells(0, times_ns, 500.0) == routes.cells(0, times_ns, 200.0)).all()
    assert cell_numbers(CONFIG, 500.0) == 36 * 4


def test_too_many_cells_are_refused() -> None:
    with pytest.raises(InputError, match=r"scheme\.cell_m is 0\.1, .* 288000 cells"):
        cell_numbers(CONFIG, 0.1)


@pytest.mark.parametrize(("blocks", "near", "far"), [(5, 200.0, 800.0), (6, 200.0, 1000.0), (2, 0.0, 400.0)])
def test_four_access_points_stand_in_a_square(blocks: int, near: float, far: float) -> None:
    points_m = access_points_m(StreetConfig(blocks=blocks))
    assert points_m.tolist() == [[near, near], [far, near], [near, far], [far, far]]


@given(blocks=st.integers(1, 9), share=st.floats(0.0, 1.0))
def test_access_points_stand_at_different_crossings(blocks: int, share: float) -> None:
    count = 1 + round(share * ((blocks + 1) ** 2 - 1))
    points_m = access_points_m(StreetConfig(blocks=blocks, access_points=count))
    assert len({tuple(point) for point in points_m.tolist()}) == count
    assert {tuple(point) for point in points_m.tolist()} <= {
        tuple(point) for point in crossings_m(StreetConfig(blocks=blocks)).tolist()
    }


def test_the_same_seed_drives_the_same_way() -> None:
    first, second = _routes(seed=4), _routes(seed=4)
    assert (first.crossings == second.crossings).all()
    assert (first.start_m == second.start_m).all()
    assert (first.crossings != _routes(seed=5).crossings).any()
