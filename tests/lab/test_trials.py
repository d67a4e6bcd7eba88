"""The store resumes, trusts whole lines only, and forgets results whose code, libraries or data changed."""

import json

import pytest

from lab import trials
from lab.trials import iterate_trials, trial_digest
from packetmesh.errors import InputError
from packetmesh.progress import drain

TASKS = [(k, "task") for k in range(5)]


class Squaring:
    """A trial that counts how often it runs."""

    __name__ = "squaring"

    def __init__(self):
        self.done = []

    def __call__(self, task):
        self.done.append(task)
        return {"square": task[0] ** 2, "nothing": float("nan"), "pair": (1, 2)}


def run(folder, function=None, **named):
    """The results, the progress, and the tasks that were computed."""
    function, steps = function or Squaring(), []
    results = drain(iterate_trials("squares", function, TASKS, folder, processes=1, **named), steps.append)
    return results, [step.fraction for step in steps], function.done


def test_results_come_in_the_order_of_the_tasks_as_json_has_them(tmp_path):
    results, fractions, done = run(tmp_path)
    assert results == [{"square": k**2, "nothing": None, "pair": [1, 2]} for k in range(5)]
    assert fractions == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    assert done == TASKS


def test_what_is_stored_is_not_computed_again(tmp_path):
    first, _, _ = run(tmp_path)
    again, fractions, done = run(tmp_path)
    assert (again, fractions, done) == (first, [1.0], [])


def test_an_interrupted_run_resumes_where_it_stopped(tmp_path):
    steps = iterate_trials("squares", Squaring(), TASKS, tmp_path, processes=1)
    for stored in range(3):
        next(steps)
        lines = [line for path in tmp_path.iterdir() for line in path.read_text().splitlines()]
        assert len(lines) == stored  # on disk before the next trial begins
    steps.close()
    results, fractions, done = run(tmp_path)
    assert fractions == [0.4, 0.6, 0.8, 1.0]
    assert done == TASKS[2:]
    assert [result["square"] for result in results] == [0, 1, 4, 9, 16]


@pytest.mark.parametrize("end", [b'{"task": "(9, ', b'null\n{"task": 3}\n{"result": 1}\nno json\n'])
def test_half_a_line_and_lines_that_are_no_results_cost_only_themselves(tmp_path, end):
    run(tmp_path)
    (path,) = tmp_path.iterdir()
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:3]) + end)
    results, _, done = run(tmp_path)
    assert done == TASKS[3:]
    assert [result["square"] for result in results] == [0, 1, 4, 9, 16]
    assert path.read_bytes().splitlines(keepends=True)[:3] == lines[:3]
    assert run(tmp_path)[2] == []


def test_more_tasks_join_those_that_are_stored(tmp_path):
    drain(iterate_trials("squares", Squaring(), TASKS[1:3], tmp_path, processes=1))
    assert run(tmp_path)[2] == [TASKS[0], *TASKS[3:]]


def test_processes_find_what_a_single_one_finds(tmp_path):
    tasks = [f"{k} ** 2" for k in range(6)]
    found = [
        drain(iterate_trials("powers", eval, tasks, tmp_path / str(count), processes=count))
        for count in (1, 2)
    ]
    assert found == [[0, 1, 4, 9, 16, 25]] * 2
    stored = (tmp_path / "2").glob("eval-*.ndjson")
    assert {json.loads(line)["task"] for line in next(stored).open()} == {repr(task) for task in tasks}


def test_other_data_are_other_trials(tmp_path, monkeypatch):
    (tmp_path / "data").mkdir()
    weights = tmp_path / "data" / "weights"
    monkeypatch.setattr(trials, "PART_BYTES", 3)
    for contents, computed in (("a", 5), ("aaaab", 5), ("aaaac", 5), ("a", 0)):
        weights.write_text(contents)
        trial_digest.cache_clear()
        assert len(run(tmp_path / "store", data=[tmp_path / "data"])[2]) == computed


def test_a_folder_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        run(tmp_path / "file")


@pytest.fixture
def house(tmp_path):
    """Packages like ours: lab.claim imports lab.tools.saw and pipeline.stage, which imports packetmesh."""
    files = {
        "packetmesh/errors.py": "LIMIT = 1",
        "pipeline/stage.py": "def stage():\n    import packetmesh.errors\n    return packetmesh.errors.LIMIT",
        "lab/tools/__init__.py": "from lab.tools import hammer",
        "lab/tools/saw.py": "TEETH = 2",
        "lab/tools/hammer.py": "HEAD = 3",
        "lab/other.py": "OTHER = 4",
        "lab/claim.py": '"""A claim."""\nfrom lab.tools import saw\nfrom pipeline.stage import stage\n',
    }
    for name, source in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(source)
    return tmp_path


def digest(house):
    trial_digest.cache_clear()
    return trial_digest("lab.claim", root=house)


@pytest.mark.parametrize(
    "name", ["packetmesh/errors.py", "pipeline/stage.py", "lab/tools/saw.py", "lab/claim.py"]
)
def test_the_digest_changes_with_the_code_that_a_trial_needs(house, name):
    before = digest(house)
    path = house / name
    path.write_text(path.read_text() + "\nMORE = 5\n")
    assert digest(house) != before


@pytest.mark.parametrize("name", ["lab/other.py", "lab/tools/hammer.py", "lab/tools/__init__.py"])
def test_the_digest_keeps_through_changes_of_other_code(house, name):
    before = digest(house)
    (house / name).write_text("MORE = 5\n")
    assert digest(house) == before


def test_the_digest_keeps_through_changes_of_words(house):
    before = digest(house)
    path = house / "lab/claim.py"
    path.write_text(path.read_text().replace("A claim.", "Another sentence.") + "# and a comment\n")
    assert digest(house) == before


@pytest.mark.parametrize(
    "library", ["numpy", "numba", "open3d-cpu", "simpy", "small-gicp", "kiss-icp", "trimesh"]
)
def test_the_digest_names_the_libraries(house, monkeypatch, library):
    versions = dict.fromkeys(trials.LIBRARIES, "1.0")
    monkeypatch.setattr(trials.metadata, "version", lambda name: versions[name])
    before = digest(house)
    versions[library] = "1.1"
    assert digest(house) != before
