"""The first share at which a surface is good enough, and the table of what it costs."""

import json

import numpy as np
import pytest

from lab.results.record import rounded
from lab.results.tile_worth import tile_worth
from lab.worth.tables import lines, measures
from lab.worth.trials import LEVELS, Node, first_share
from pipeline.delivery.tiled import Pieces


@pytest.mark.parametrize("at", [0.02, 0.1, 0.3, 0.64, 0.9])
def test_the_first_share_of_a_score_that_rises_in_a_straight_line_is_where_it_rises_to(at):
    asked = []

    def score(share):
        asked.append(share)
        return share

    assert first_share(score, at) == pytest.approx(at)
    assert set(asked) <= set(LEVELS)
    assert len(set(asked)) <= 4


def test_a_score_that_is_enough_at_once_or_never():
    assert first_share(lambda share: 0.9, 0.8) == LEVELS[0]
    assert first_share(lambda share: 0.7, 0.8) is None


def test_the_tiles_of_a_share_are_the_first_of_the_order_that_hold_it():
    node = Node(Pieces(b"", (), ()), np.array([2, 0, 3, 1]), np.array([10, 0, 30, 60]))
    assert node.tiles_until(0.3) == 1
    assert node.tiles_until(0.31) == 2
    assert node.tiles_until(1.0) == 3
    np.testing.assert_array_equal(node.missing_after(0.35, (2, 2)), [[False, True], [False, True]])


def row(rig, order, kb, seed=0, share=0.3):
    return {
        "rig": rig,
        "order": order,
        "f_score": 0.8,
        "scores": [(0.015, 0.76), (0.4, 0.79)],
        "network": "office",
        "loss": 0.1,
        "target": 0.99,
        "seed": seed,
        "share": share,
        "image_bytes": 1000 * kb,
        "seconds": kb / 100,
        "joules": float(kb),
    }


ROWS = [
    row("office", "own", 100),
    row("office", "worth", 40, 0),
    row("office", "worth", 60, 1),
    row("room-1", "own", 200, share=None),
    row("room-2", "own", 100),
    row("room-1", "worth", 50),
    row("room-2", "worth", 50),
]


def test_each_rig_is_compared_with_itself_and_seeds_count_once():
    text = list(lines(measures(ROWS)))
    assert "95.00" in text[0] or "0.95" in text[0]
    assert any(line.startswith("1 demo rooms, office, 10% lost, 99% of F, worth: 50.00") for line in text)
    entry = next(
        one for one in measures(ROWS)["rows"] if (one["rooms"], one["order"]) == ("random rooms", "worth")
    )
    assert entry["of_own"][0] == pytest.approx((0.25 + 0.5) / 2)
    assert entry["rigs"] == 2


def test_the_page_has_a_table_for_each_kind_of_rooms():
    text = tile_worth(rounded(json.loads(json.dumps(measures(ROWS)))))
    assert "**held-out random rooms, until 99.0 % of the F-score**" in text
    lines_of = [line for line in text.splitlines() if line.startswith("| office")]
    assert len(lines_of) == 4
    assert "2, 1 with colour" in lines_of[2]
    assert "37.50 (" in lines_of[3]
