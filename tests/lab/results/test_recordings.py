"""The table of recordings, from made-up numbers."""

from lab.results.recordings import recordings

RUN = {
    "program": "ours",
    "walks": 3,
    "lost": 1,
    "crashed": 0,
    "peak_memory_bytes": 5.0e8,
    "ate_m": 0.0123,
    "worst_ate_m": None,
    "ate_share": 0.005,
    "worst_ate_share": None,
    "rpe_m": 0.02,
    "worst_rpe_m": 0.03,
    "without_pose": 0,
    "worst_without_pose": 7,
    "frames_s": 21.4,
    "worst_frames_s": 18.6,
    "map_median_m": None,
    "worst_map_median_m": None,
    "f_2cm": 0.847,
    "worst_f_2cm": 0.791,
    "f_5cm": None,
    "worst_f_5cm": None,
    "without_surface": 0.081,
    "worst_without_surface": 0.2,
}


def test_a_row_has_median_and_worst_in_its_units_and_dashes_where_nothing_is_known():
    page = recordings({"recording: every fifth frame": {"runs": [RUN]}})
    assert "Every fifth frame:" in page
    row = page.splitlines()[-1]
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[:7] == ["ours", "1 of 3", "1.23 (–)", "0.50 % (–)", "2.00 (3.00)", "0 (7)", "21 (19)"]
    assert cells[7:10] == ["500", cells[8], "84.7 % (79.1 %)"]
    assert cells[11] == "8.1 % (20.0 %)"
    assert cells[8] == cells[10]  # not measured


def test_a_walk_that_a_programs_crash_lost_is_named():
    page = recordings({"recording: every frame": {"runs": [RUN | {"crashed": 1}]}})
    assert "| 1 of 3 (1 by a crash) |" in page
