"""Where the nodes of a layout stand, in units of its spacing, around a sink at the origin."""

from __future__ import annotations

import numpy as np
import pytest

from network_sim.config import NodesConfig
from network_sim.radio.places import place_nodes


def places(count: int, layout: str) -> np.ndarray:
    config = NodesConfig(count=count, layout=layout, spacing_m=5.0)
    return place_nodes(config, np.random.default_rng(0)).positions_m / 5.0


@pytest.mark.parametrize(
    ("layout", "expected"),
    [
        ("star", [(1, 0), (0, 1), (-1, 0), (0, -1)]),
        ("line", [(1, 0), (2, 0), (3, 0), (4, 0)]),
        ("grid", [(0, 1), (0, 2), (1, 0), (1, 1)]),
    ],
)
def test_four_nodes_and_the_sink_stand_where_the_layout_says(layout: str, expected: list) -> None:
    np.testing.assert_allclose(places(4, layout), [*expected, (0, 0)], atol=1e-12)


def test_a_grid_that_is_full_has_a_node_on_every_corner_but_the_sinks() -> None:
    assert {tuple(place) for place in places(8, "grid").tolist()} == {
        (x, y) for x in range(3) for y in range(3)
    }


def test_random_nodes_fill_a_square_with_one_spacing_squared_each() -> None:
    placed, side = places(899, "random")[:-1], 30.0
    assert np.abs(placed).max() <= 0.5 * side
    np.testing.assert_allclose(placed.mean(axis=0), 0.0, atol=0.04 * side)
    np.testing.assert_allclose(placed.std(axis=0), side / np.sqrt(12.0), rtol=0.06)
