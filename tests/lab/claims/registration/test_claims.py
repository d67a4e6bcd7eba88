"""C16 to C20 judge what the trials say, whatever that is; they share one run."""

import json
from dataclasses import replace
from functools import cache

import pytest

from app.reports.reproduction import write_reproduction_report
from lab.claims import registry
from lab.claims.exhibits import Chart, HeatMap, Table
from lab.claims.registration.cases import CONDITIONS
from lab.claims.registration.results import Results
from lab.claims.registration.setup import CAPTURED, CURVED, standard_lineup
from lab.claims.registration.trials import CURVE_ITERATIONS
from packetmesh.files import finite
from packetmesh.progress import Progress

IDS = ("C16", "C17", "C18", "C19", "C20")
ROOMS = 12


def _trial(condition: str, room: int, direction: str, entrant: str, error_cm: float, iterations: int) -> dict:
    error_cm *= 1.0 + 0.01 * ((7 * room) % 5)
    curve = [10.0, *[error_cm] * iterations] if entrant in CURVED and direction == "q2p" else []
    return {
        "condition": condition,
        "room": room,
        "direction": direction,
        "entrant": entrant,
        "point_error_cm": error_cm,
        "ahd_cm": 4.0,
        "iterations": iterations,
        "k90": iterations,
        "stop_reason": "converged",
        "start_error_cm": 10.0,
        "overlap": 0.6,
        "curve_error_cm": curve,
        "curve_ahd_cm": [4.0] * len(CURVE_ITERATIONS) if curve else [],
        "elapsed_s": [0.01 * k for k in range(len(curve) - 1)],
    }


def _results(error_cm=None, iterations=None, far_captured=None) -> Results:
    """Made-up trials of the whole benchmark: everyone errs by 1 cm in 20 iterations but those named."""
    error_cm, iterations = error_cm or {}, iterations or {}
    trials = [
        _trial(condition, room, direction, name, error_cm.get(name, 1.0), iterations.get(name, 20) + room % 3)
        for room in range(ROOMS)
        for condition, lineup in _lineups().items()
        for direction, name in lineup
    ]
    cells = [
        {
            "entrant": entrant.name,
            "rotation_deg": r,
            "translation_m": t,
            "captured": r < 45 or t < 0.6 or bool(far_captured),
        }
        for _ in range(ROOMS)
        for entrant, _ in CAPTURED
        for r in (5.0, 45.0)
        for t in (0.1, 0.6)
    ]
    return Results(trials, cells)


@cache
def _lineups() -> dict:
    return {
        name: [(direction, entrant.name) for direction, entrant in standard_lineup(condition)]
        for name, condition in CONDITIONS.items()
    }


def _verdict(id_: str, **named) -> str:
    return registry.CLAIMS[id_].judge(_results(**named)).verdict


def test_c16_needs_all_four_rivals_beaten():
    beaten = dict.fromkeys(("icp", "picp", "ricp", "mricp"), 2.0)
    assert _verdict("C16", error_cm=beaten) == "reproduced"
    assert _verdict("C16", error_cm=beaten | {"ricp": 1.0}) == "not reproduced"
    assert _verdict("C16", error_cm=beaten | {"ceicp-a": 3.0}) == "not reproduced"


def test_c17_needs_at_most_six_tenths_of_icps_error():
    assert _verdict("C17", error_cm={"icp": 2.0}) == "reproduced"
    assert _verdict("C17", error_cm={"icp": 1.5}) == "not reproduced"
    ours = registry.CLAIMS["C17"].judge(_results(error_cm={"icp": 2.0})).ours
    assert ours["point_error_ratio_ceicp-n"] == pytest.approx(0.5)
    assert ours["ahd_ratio_ceicp-n"] == 1.0


def test_c18_holds_unless_ceicp_is_worse():
    for mricp_cm, verdict in ((1.0, "reproduced"), (2.0, "reproduced"), (0.5, "not reproduced")):
        assert _verdict("C18", error_cm={"mricp": mricp_cm}) == verdict


def test_c19_needs_fewer_iterations_of_both_versions():
    assert _verdict("C19", iterations={"icp": 40}) == "reproduced"
    assert _verdict("C19", iterations={"icp": 40, "ceicp-a": 60}) == "not reproduced"
    assert _verdict("C19") == "not reproduced"


def test_c20_needs_a_farthest_start_that_fails():
    assert _verdict("C20") == "reproduced"
    assert _verdict("C20", far_captured=True) == "not reproduced"


def test_c20_counts_its_rooms_with_their_interval():
    """Of 12 rooms and no failure, Wilson's interval begins at 1 / (1 + 1.96^2 / 12)."""
    verdict = registry.CLAIMS["C20"].judge(_results())
    assert "icp 12 of 12 and 0 of 12, 75% from all starts" in verdict.why
    assert verdict.ours["captured_farthest_icp"] == 0.0
    assert verdict.ci95["captured_nearest_icp"] == pytest.approx(
        (1.0 / (1.0 + 1.96**2 / 12.0), 1.0), abs=1e-4
    )
    notes = {exhibit.title: exhibit.note for exhibit in verdict.exhibits}
    assert notes["capture range, ceicp-n, T_d 0.3 m"].endswith("of “easy”.")
    assert notes["capture range, ceicp-n"].startswith("Share of 12 rooms")
    assert "T_d is twice the translation, at least 0.3 m" in notes["capture range, ceicp-n"]


def test_equal_errors_are_reported_as_ties():
    why = registry.CLAIMS["C16"].judge(_results(error_cm={"icp": 2.0})).why
    assert "ficp 1.00 (tie)" in why
    assert "hicp 1.00 (tie)" in why


def test_claims_with_the_same_trials_share_one_run_whose_progress_comes_first(monkeypatch, tmp_path):
    runs = []

    def prepare(folder, scheduler):
        runs.append((folder, scheduler))
        yield Progress("trials", 0.5)
        return _results()

    shared = {id_: replace(registry.CLAIMS[id_], prepare=prepare) for id_ in IDS}
    monkeypatch.setattr(registry, "CLAIMS", shared)
    events = list(registry.run_claims(folder=tmp_path, scheduler="tcp://x"))
    assert runs == [(tmp_path, "tcp://x")]
    assert isinstance(events[0], Progress)
    assert [verdict.id for verdict in events[1:]] == list(IDS)


@pytest.fixture(scope="module")
def verdicts():
    results = _results(error_cm={"icp": 2.0})
    return [registry.CLAIMS[id_].judge(results) for id_ in IDS]


def test_the_exhibits_hold_the_promised_tables_and_pictures(verdicts):
    exhibits = {exhibit.title: exhibit for verdict in verdicts for exhibit in verdict.exhibits}
    filled = exhibits["Table 4.4, filled in"]
    assert filled.rows[0][:4] == ("icp", 8.21, 10.12, 23.84)
    assert filled.rows[0][8] == pytest.approx(2.04)
    kinds = [type(exhibit) for exhibit in exhibits.values()]
    assert (kinds.count(Chart), kinds.count(HeatMap)) == (6, 5)
    assert kinds.count(Table) >= 7
    for exhibit in exhibits.values():
        if isinstance(exhibit, Table):
            assert {len(row) for row in exhibit.rows} == {len(exhibit.header)}


def test_the_report_draws_every_exhibit_and_the_record_is_strict_json(verdicts, tmp_path):
    write_reproduction_report(verdicts, tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text()
    pictures = sum(not isinstance(e, Table) for verdict in verdicts for e in verdict.exhibits)
    assert text.count("<svg") == text.count("</svg>") == pictures
    assert "Table 4.4, filled in" in text
    assert "nan" not in text
    json.dumps(finite([verdict.record() for verdict in verdicts]), allow_nan=False)
