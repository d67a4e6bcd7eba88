"""WORTH against its definition (SPEC 6.2): pieces, costs, the choice, and whole runs."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from network_sim.config import MacConfig, NetworkConfig, RunConfig, SchemeConfig, StreetConfig
from network_sim.metrics.metrics import metrics
from network_sim.simulate import simulate
from network_sim.street.mobility import routes_of
from network_sim.street.pieces import Cuts, Part
from network_sim.street.schemes.greedy import Coverage, select
from network_sim.street.schemes.worth import Worth, best_run, select_pieces
from network_sim.street.snapshots import shown_pieces
from network_sim.trace.conservation import check
from network_sim.types import EventKind, PacketKind
from packetmesh.errors import InputError

VALIDITY = 10
PIECES = 3
CONFIG = SchemeConfig(name="worth", pieces=PIECES, image_bytes=900)
IMAGES = st.lists(st.tuples(st.integers(-1, 6), st.integers(0, 40)), max_size=7)


def _rows(images: list[tuple[int, int]]) -> list[list[int]]:
    """Pieces that images show: three in a row; the road ends after piece 6."""
    return [[at + i if 0 <= at + i <= 6 else -1 for i in range(PIECES)] for at, _ in images]


def _covered(images: list[tuple[int, int]]) -> tuple[Coverage, set[tuple[int, int]]]:
    coverage, seconds = Coverage(VALIDITY), set()
    for row, (_, taken) in zip(_rows(images), images, strict=True):
        for piece in row:
            if piece >= 0:
                coverage.add(piece, taken)
                seconds |= {(piece, taken + second) for second in range(VALIDITY)}
    return coverage, seconds


def _plain(known: list[tuple[int, int]], offered: list[tuple[int, int]], k: int | None) -> list[Part]:
    """The choice by judging every run of every image again, before every choice."""
    _, seconds = _covered(known)
    rows, cuts, chosen = _rows(offered), Cuts(CONFIG), []
    while k is None or len(chosen) < k:
        best = None
        for index, (_, taken) in enumerate(offered):
            if index in {part.row for part in chosen}:
                continue
            new = [{(piece, taken + s) for s in range(VALIDITY)} - seconds for piece in rows[index]]
            wanted = [
                piece >= 0 and len(n) >= VALIDITY / 2 for piece, n in zip(rows[index], new, strict=True)
            ]
            for first in range(PIECES):
                for stop in range(first + 1, PIECES + 1):
                    ends = not (first and wanted[first - 1]) and not (stop < PIECES and wanted[stop])
                    if all(wanted[first:stop]) and ends:
                        value = sum(map(len, new[first:stop])) / cuts.costs_bytes[first][stop]
                        if best is None or value > best[0]:
                            best = value, index, first, stop, set().union(*new[first:stop])
        if best is None:
            break
        _, index, first, stop, gained = best
        chosen.append(Part(index, tuple(rows[index][first:stop]), first, stop))
        seconds |= gained
    return chosen


@given(IMAGES, IMAGES, st.one_of(st.none(), st.integers(1, 4)))
def test_the_choice_is_the_plain_one(known, offered, k) -> None:
    taken = [t for _, t in offered]
    assert select_pieces(_covered(known)[0], _rows(offered), taken, k, Cuts(CONFIG)) == _plain(
        known, offered, k
    )


@given(IMAGES, IMAGES)
def test_no_covered_piece_is_asked_for_and_none_is_left(known, offered) -> None:
    coverage, seconds = _covered(known)
    rows, taken = _rows(offered), [t for _, t in offered]
    chosen = select_pieces(coverage, rows, taken, None, Cuts(CONFIG))
    for part in chosen:
        assert part.shows == tuple(rows[part.row][part.first : part.stop])
        for piece in part.shows:
            new = {(piece, taken[part.row] + second) for second in range(VALIDITY)} - seconds
            assert piece >= 0
            assert len(new) >= VALIDITY / 2
            seconds |= new
    asked = {part.row for part in chosen}
    for index, row in enumerate(rows):
        if index not in asked:
            for piece in row:
                new = {(piece, taken[index] + second) for second in range(VALIDITY)} - seconds
                assert piece < 0 or len(new) < VALIDITY / 2, "an image of which nothing was asked adds little"


@given(
    st.lists(st.tuples(st.integers(0, 2), st.integers(0, 40)), max_size=7),
    st.lists(st.tuples(st.integers(0, 2), st.integers(0, 40)), max_size=7),
    st.one_of(st.none(), st.integers(1, 4)),
)
def test_with_whole_images_it_is_greedy(known, offered, k) -> None:
    greedy, worth = Coverage(VALIDITY), Coverage(VALIDITY)
    for image in known:
        greedy.add(*image)
        worth.add(*image)
    cells, taken = [cell for cell, _ in offered], [t for _, t in offered]
    chosen = select_pieces(worth, [[cell] for cell in cells], taken, k, Cuts(replace(CONFIG, pieces=1)))
    assert [part.row for part in chosen] == select(greedy, cells, taken, k)


def test_a_small_case_by_hand() -> None:
    """Three images from pieces 0, 1 and 2 at 0, 2 and 4 s; pieces 1 and 2 were already shown at 0 s.

    Image 0 adds 10 s of piece 0 and image 1 as much of piece 3, in 378 bytes each. Image 2 adds 20 s of
    pieces 3 and 4 in 678 bytes, which is more per byte; after it, image 1 would add only 2 s of piece 3.
    """
    coverage = _covered([(1, 0)])[0]
    coverage.remove(3, 0)
    cuts = Cuts(CONFIG)
    assert (cuts.costs_bytes[0][1], cuts.costs_bytes[1][3], cuts.costs_bytes[0][3]) == (378, 678, 938)
    offered = [(0, 0), (1, 2), (2, 4)]
    chosen = select_pieces(coverage, _rows(offered), [0, 2, 4], None, cuts)
    assert chosen == [Part(2, (3, 4), 1, 3), Part(0, (0,), 0, 1)]


def test_the_better_of_two_runs_is_asked_for() -> None:
    cuts = Cuts(replace(CONFIG, pieces=5))
    found = best_run([10, 2, 10, 10, 4], 5.0, cuts)
    assert (found.first, found.stop) == (2, 4)
    assert best_run([4, 4, 4, 4, 4], 5.0, cuts) is None
    assert best_run([6, 2, 7, 0, 0], 5.0, cuts)[1:] == (2, 3), "equal bytes"


@pytest.mark.parametrize(("image_bytes", "pieces"), [(1000, 5), (1000, 3), (30_000, 7)])
def test_datagrams_carry_just_the_bytes_of_the_pieces(image_bytes: int, pieces: int) -> None:
    config = SchemeConfig(image_bytes=image_bytes, pieces=pieces)
    cuts = Cuts(config)
    assert [cuts.edges[0], cuts.edges[-1]] == [0, image_bytes]
    for first in range(pieces):
        for stop in range(first + 1, pieces + 1):
            parts = cuts.datagrams(first, stop)
            carried = [byte for start, size in parts for byte in range(start, start + size)]
            assert carried == list(range(cuts.edges[first], cuts.edges[stop]))
            header_bytes = 0 if stop - first == pieces else 40
            assert all(size + header_bytes <= config.datagram_bytes for _, size in parts)
            cost = 10 + len(carried) + len(parts) * (28 + header_bytes)
            assert cuts.costs_bytes[first][stop] == cost


def test_what_did_not_come_is_asked_for_again() -> None:
    worth = Worth(SchemeConfig(name="worth"))
    shown, taken = np.arange(5)[None], np.array([100])
    (part,) = worth.parts(shown, taken, 0)
    assert (part.row, part.shows, part.first, part.stop) == (0, (0, 1, 2, 3, 4), 0, 5)
    assert worth.parts(shown, taken, 0) == []
    worth.missed(2, 100)
    assert worth.parts(shown, taken, 0) == [Part(0, (2,), 2, 3)]


@pytest.mark.parametrize("directed", [True, False])
def test_images_show_the_road_straight_ahead(directed: bool) -> None:
    config = _config("worth", 20)
    routes = routes_of(config)
    scheme = replace(config.scheme, directed_cells=directed)
    for vehicle in range(20):
        taken_ns = np.arange(0, 600 * 10**9, 2 * 10**9)
        shown = shown_pieces(routes, scheme, vehicle, taken_ns)
        assert (shown[:, 0] == routes.cells(vehicle, taken_ns, 20.0, directed)).all()
        segment, into_m = routes.segments(vehicle, taken_ns)
        steady = np.flatnonzero(np.diff(segment) == 0)  # 20 m farther on the same street: all moves up by one
        assert (shown[steady, 1:] == shown[steady + 1, :-1]).all()
        turned = np.diff(routes.headings[vehicle]) != 0
        straight = np.flatnonzero((np.diff(segment) == 1) & ~turned[segment[:-1]])
        assert (shown[straight, 1:] == shown[straight + 1, :-1]).all(), "over the crossing"
        beyond = (shown < 0).any(axis=1)
        assert (into_m[beyond] > 100.0 - 1e-6).all(), "only the last 100 m before the border"
        assert ((shown < 0)[:, 1:] >= (shown < 0)[:, :-1]).all()


def _config(name: str, vehicles: int, **changes) -> NetworkConfig:
    return NetworkConfig(
        scenario="street-grid",
        mac=MacConfig(kind="ideal", link_bps=11e6),
        scheme=SchemeConfig(**{"name": name} | changes),
        street=StreetConfig(vehicles=vehicles),
        run=RunConfig(horizon_s=1500.0, warmup_s=600.0, seed=1),
    )


def test_with_one_piece_runs_bring_the_images_of_greedy() -> None:
    greedy, worth = (simulate(_config(name, 12, pieces=1)) for name in ("greedy", "worth"))
    check(worth)
    arrived = [trace.events.of(EventKind.ARRIVE).image for trace in (greedy, worth)]
    assert arrived[0].tolist() == arrived[1].tolist()
    found = [metrics(trace) for trace in (greedy, worth)]
    assert (
        found[0]["coverage_pieces"].value == found[0]["coverage"].value == found[1]["coverage_pieces"].value
    )


def test_pieces_cover_more_than_whole_images_in_as_many_bytes() -> None:
    greedy, worth, everything = (simulate(_config(name, 30)) for name in ("greedy", "worth", "baseline"))
    found = [metrics(trace) for trace in (greedy, worth, everything)]
    covered = [run["coverage_pieces"].value for run in found]
    assert covered[0] + 0.05 < covered[1] <= covered[2]
    assert found[1]["goodput"].value < 1.1 * found[0]["goodput"].value
    assert found[1]["request_bytes"].value > found[0]["request_bytes"].value, "the price"
    assert "coverage" not in found[1], "of whole cells"


def test_only_the_pieces_asked_for_are_sent() -> None:
    trace = simulate(_config("worth", 12, image_bytes=6000))
    check(trace)
    came, received = trace.events.of(EventKind.ARRIVE), trace.events.of(EventKind.RECEIVE)
    received = received.where(received.packet_kind == PacketKind.IMAGE)
    assert len(np.unique(came.size_bytes)) > 2
    for image, first, size_bytes in zip(came.image, came.first_byte, came.size_bytes, strict=True):
        parts = received.where(received.image == image)
        header_bytes = 28 if size_bytes == 6000 else 68
        assert parts.first_byte[0] == first
        assert parts.size_bytes.sum() == size_bytes + header_bytes * len(parts)
        assert first % 1200 == size_bytes % 1200 == 0


@pytest.mark.parametrize(
    "changes", [{"pieces": 0}, {"pieces": 65}, {"image_bytes": 4}, {"piece_header_bytes": -1}]
)
def test_pieces_that_cannot_be_are_refused(changes) -> None:
    with pytest.raises(InputError, match="scheme"):
        SchemeConfig(**changes)
