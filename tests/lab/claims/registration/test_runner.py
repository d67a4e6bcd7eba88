"""Tiny benchmarks: the same whatever the number of processes, and resumed after an interruption."""

import json
from dataclasses import replace

import pytest

from lab.claims.registration.entrants import Entrant
from lab.claims.registration.results import Results
from lab.claims.registration.runner import compute, run_trials
from lab.claims.registration.setup import Setup, standard_setup
from lab.claims.registration.store import Store

METHODS = (Entrant("icp"), Entrant("ceicp-n"), Entrant("ceicp-a", "plane"))
SETUP = Setup(
    rooms=(2000, 2001),
    lineups={"easy": tuple(("q2p", e) for e in METHODS), "nodes-sensor": (("q2p", METHODS[2]),)},
    max_points=500,
    curves=("easy",),
)
TASKS = [(name, room) for room in SETUP.rooms for name in SETUP.lineups]


def finish(running):
    """What a generator yields, and what it returns."""
    events = []
    while True:
        try:
            events.append(next(running))
        except StopIteration as end:
            return events, end.value


def trials(results):
    return {task: result["trials"] for task, result in results.items()}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one")
    return folder, *finish(run_trials(SETUP, folder, workers=1))


def test_all_tasks_come_in_order_with_rising_progress(done):
    _, events, results = done
    assert list(results) == TASKS
    fractions = [event.fraction for event in events]
    assert fractions == sorted(fractions)
    assert (fractions[0], fractions[-1]) == (0.0, 1.0)


def test_two_processes_find_what_one_finds(done, tmp_path):
    _, results = finish(run_trials(SETUP, tmp_path, workers=2))
    assert trials(results) == trials(done[2])


def test_a_run_that_is_stopped_and_cut_off_goes_on(done, tmp_path):
    """Half a line, as a power cut leaves it, costs that one task; whole lines are not computed again."""
    folder, _, results = done
    name = next(folder.iterdir()).name
    lines = (folder / name).read_bytes().splitlines(keepends=True)
    (tmp_path / name).write_bytes(lines[0] + lines[1] + lines[2][: len(lines[2]) // 2])
    events, again = finish(run_trials(SETUP, tmp_path, workers=1))
    assert events[0].fraction == 0.5
    assert len(events) == 3
    assert trials(again) == trials(results)
    kept = (tmp_path / name).read_bytes().splitlines(keepends=True)
    assert kept[:2] == lines[:2]
    assert len(kept) == 4
    assert all(json.loads(line)["task"] for line in kept)


def test_a_finished_run_computes_nothing(done):
    folder, _, results = done
    events, again = finish(run_trials(SETUP, folder, workers=1))
    assert [event.fraction for event in events] == [1.0]
    assert again == results


def test_a_line_that_is_no_result_is_done_again(tmp_path):
    store = Store(tmp_path, "k")
    store.add(("easy", 1), {"trials": []})
    with store.path.open("a") as file:
        file.write('null\n{"task": ["easy"]}\n')
    store.add(("easy", 2), {"trials": [1]})
    assert Store(tmp_path, "k").results == {("easy", 1): {"trials": []}, ("easy", 2): {"trials": [1]}}


def test_stopping_ends_without_a_trace_but_what_was_stored(tmp_path):
    running = run_trials(SETUP, tmp_path, workers=1)
    next(running)
    next(running)
    running.close()
    assert len(Store(tmp_path, SETUP.key()).results) == 1


def test_the_key_changes_with_what_results_depend_on_but_not_with_the_rooms():
    assert replace(SETUP, rooms=(1,)).key() == SETUP.key()
    changes = ({"max_points": 600}, {"curves": ()}, {"lineups": {"easy": (("p2q", METHODS[0]),)}})
    assert len({SETUP.key(), *(replace(SETUP, **change).key() for change in changes)}) == 4


def test_a_trial_records_what_the_tables_need(done):
    results = Results(done[2])
    assert results.conditions == ("easy", "nodes-sensor")
    assert results.entrants(("easy",)) == ("icp", "ceicp-n", "ceicp-a plane")
    assert results.entrants(("easy", "nodes-sensor")) == ("ceicp-a plane",)
    for trial in results.trials("ceicp-a plane", ("easy",)):
        assert trial["point_error_cm"] < 0.3 * trial["start_error_cm"]
        assert trial["success"] == (trial["point_error_cm"] < 2.0)
        assert len(trial["curve_error_cm"]) == trial["iterations"] + 1 == len(trial["elapsed_s"]) + 1
        assert trial["curve_error_cm"][-1] == trial["point_error_cm"]
        assert trial["curve_ahd_cm"][-1] == trial["ahd_cm"]
        assert 0 < trial["k90"] <= trial["iterations"]
        assert trial["seconds"] > 0
    assert results.trials("ceicp-a plane", ("nodes-sensor",))[0]["curve_error_cm"] == []


def test_capture_tasks_map_the_starts(tmp_path):
    setup = replace(SETUP, captured=((Entrant("ceicp-a", "plane"), True),))
    cells = compute(setup, ("capture", 2000))["cells"]
    assert len(cells) == 25
    assert {cell["entrant"] for cell in cells} == {"ceicp-a plane"}
    near = next(c for c in cells if (c["rotation_deg"], c["translation_m"]) == (5.0, 0.1))
    assert near["home"]


def test_the_standard_benchmark_is_what_the_specification_asks_for():
    setup = standard_setup()
    assert len(setup.rooms) >= 30
    assert setup.max_points == 4000
    assert len(setup.lineups) == 12
    table = {"icp", "picp", "ricp", "mricp", "ficp", "hicp", "ceicp-literal", "ceicp-n", "ceicp-a"}
    for name, lineup in setup.lineups.items():
        entrants = [(direction, entrant.name) for direction, entrant in lineup]
        assert len(set(entrants)) == len(entrants)
        if not name.startswith("overlap"):
            assert {("q2p", method) for method in table} <= set(entrants)
    back = {name: [e.name for d, e in lineup if d == "p2q"] for name, lineup in setup.lineups.items()}
    assert back["easy"] == back["holes-x3"] == ["icp", "icp-gated", "ficp", "hicp", "ceicp-n", "ceicp-a"]
    assert back["nodes-sensor"] == ["ceicp-a plane"]
    assert set(setup.rooms).isdisjoint(range(1000, 2000))
