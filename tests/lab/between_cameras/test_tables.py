"""The table of bytes saved and F-scores lost."""

import json

from lab.between_cameras.tables import lines, measures
from lab.results.between_cameras import between_cameras
from lab.results.record import rounded


def row(rig: str, method: str, f_score: float, share: float) -> dict[str, str | float]:
    return {
        "rig": rig,
        "poses": "right",
        "method": method,
        "bytes": share,
        "depth_bytes": 2 * share,
        "tiles": share,
        "whole_bytes": 4e5,
        "chain_f_score_5cm": f_score,
    }


ROWS = [
    row("office", "all tiles", 0.9, 0.0),
    row("office", "ours", 0.89, 0.3),
    row("room-1", "all tiles", 0.8, 0.0),
    row("room-1", "ours", 0.81, 0.1),
    row("room-2", "all tiles", 0.5, 0.0),
    row("room-2", "ours", 0.5, 0.2),
]


def test_each_rig_is_compared_with_itself_and_demo_rooms_are_apart():
    text = list(lines(ROWS))
    assert text[0] == "1 demo rooms"
    assert "bytes saved 30.00" in text[3]
    assert "F at 5 cm by the chain -1.00" in text[3]
    assert text[4] == "2 random rooms"
    assert "bytes saved 15.00 (10.00 to 20.00) %" in text[7]
    assert "F at 5 cm by the chain +0.50 (+0.00 to +1.00), worst +0.00" in text[7]


def test_the_page_has_a_table_for_each_kind_of_rooms_from_the_printed_numbers():
    numbers = rounded(json.loads(json.dumps(measures(ROWS))))
    text = between_cameras(numbers)
    assert "**1 demo rooms**" in text
    assert "**2 held-out random rooms**" in text
    lines_of = [line for line in text.splitlines() if line.startswith("| right")]
    assert len(lines_of) == 4
    cells = [cell.strip() for cell in lines_of[3].split("|")[1:-1]]
    assert cells[:4] == ["right", "ours", "15.00 (10.00 to 20.00)", "0"]
    assert cells[4:7] == ["–", "–", "+0.50 (+0.00 to +1.00), +0.00"]
    assert [cell.strip() for cell in lines_of[2].split("|")[1:-1]][:3] == ["right", "all tiles", "of 400 kB"]
    assert "65.00 %" in lines_of[2]
