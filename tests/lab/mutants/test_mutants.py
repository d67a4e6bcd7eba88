"""Mutants: when a stored answer and a reason count, what counts as seen, and the numbers of the page."""

import json
import re
import subprocess
from dataclasses import replace

import pytest

pytest.importorskip("cosmic_ray", reason="cosmic-ray is installed for make mutants only")

from lab.mutants import mutations, testing
from lab.mutants.__main__ import answered
from lab.mutants.mutations import Mutation, draw
from lab.mutants.page import WHYS, Reasons, Score, page
from packetmesh.errors import InputError

FAILED = "FAILED tests/shop/half/test_half.py::test_half - assert 4 == 1\n1 failed in 0.1s\n"
HALF = "LIMIT = 3\n\n\ndef half(x):\n    return x / 2\n"


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A repository with one module, its own tests, and the tests of its group."""
    monkeypatch.setattr(mutations, "GROUPS", {"mac": (("shop/*.py",), ("tests/shop",))})
    monkeypatch.setattr(testing, "GROUPS", mutations.GROUPS)
    monkeypatch.setattr("lab.mutants.__main__.GROUPS", mutations.GROUPS)
    for path, text in {
        "shop/half.py": HALF,
        "tests/shop/test_all.py": "",
        "tests/shop/half/test_half.py": "",
    }.items():
        (tmp_path / "copy" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "copy" / path).write_text(text)
    return tmp_path / "copy"


def _doubles(copy) -> Mutation:
    """The fault that multiplies by 2 in place of halving."""
    (found,) = (one for one in draw(copy, 100, 1) if "Div_Mul" in one.operator)
    return found


def _exits(monkeypatch, *codes):
    """Let pytest end with these exit codes (None exceeds the time); return the paths' last names."""
    ran, left = [], list(codes)

    def run(command, timeout, **_):
        ran.append([path.rpartition("/")[2] for path in command[9:]])
        code = left.pop(0)
        if code is None:
            raise subprocess.TimeoutExpired(command, timeout)
        return subprocess.CompletedProcess(command, code, stdout=FAILED if code else "")

    monkeypatch.setattr(testing.subprocess, "run", run)
    return ran


def test_a_mutant_knows_its_line(copy):
    one = _doubles(copy)
    assert (one.line, one.source) == (5, "return x / 2")
    assert one.applied(HALF) == HALF.replace("x / 2", "x * 2")


def test_a_new_module_changes_no_other_draw(copy):
    before = draw(copy, 3, 1)
    assert draw(copy, 3, 2) != before
    (copy / "shop/whole.py").write_text("def whole(x):\n    return 1 + x\n")
    after = draw(copy, 100, 1)
    assert [one for one in after if one.path == "shop/half.py"][:3] == before


@pytest.mark.parametrize(
    ("codes", "seen"),
    [
        ((1,), True),
        ((0, 1), True),
        ((0, 0), False),
        ((None,), True),
        ((2,), True),  # an import fails
        ((0, 4), True),  # the import of a conftest.py fails
        ((-11,), True),  # a crash
        ((0, 139), True),
        ((5, 0), False),  # all tests of the module are skipped
    ],
)
def test_a_fault_is_seen_unless_all_tests_pass_in_time(copy, monkeypatch, codes, seen):
    ran = _exits(monkeypatch, *codes)
    assert testing.sees(copy, _doubles(copy), 1.0).seen == seen
    assert ran == [["test_half.py"], ["shop"]][: len(codes)]
    assert (copy / "shop/half.py").read_text() == HALF


@pytest.mark.parametrize("code", [-9, -15])
def test_killed_tests_are_no_answer(copy, monkeypatch, tmp_path, code):
    _exits(monkeypatch, 0, 0, code)
    with pytest.raises(InputError, match=r"half\.py .*Div_Mul.* were killed.* neither seen nor unseen"):
        answered([copy], [_doubles(copy)], tmp_path / "answers.jsonl")
    assert (copy / "shop/half.py").read_text() == HALF
    assert not (tmp_path / "answers.jsonl").exists()


def test_no_fault_is_planted_if_a_test_fails_without_one(copy, monkeypatch, tmp_path):
    ran = _exits(monkeypatch, 1)
    with pytest.raises(InputError, match=r"group mac fail without a fault \(1 failed in 0\.1s\)"):
        answered([copy], [_doubles(copy)], tmp_path / "answers.jsonl")
    assert ran == [["test_half.py", "shop"]]
    assert not (tmp_path / "answers.jsonl").exists()


@pytest.mark.parametrize(
    ("code", "changed", "counts"),
    [
        (0, "shop/half.py", False),
        (0, "tests/shop/test_all.py", False),
        (0, "tests/shop/half/test_half.py", False),
        (1, "shop/half.py", False),
        (1, "tests/shop/test_all.py", True),  # another test than the one that saw the fault
        (1, "tests/shop/half/test_half.py", False),
    ],
)
def test_an_answer_counts_until_the_module_or_a_test_that_matters_changes(
    copy, monkeypatch, tmp_path, code, changed, counts
):
    answers = tmp_path / "answers.jsonl"
    first = (0, code) if code else (0, 0, 0)
    ran = _exits(monkeypatch, *first, 0, 0, 0, 0)
    one = _doubles(copy)
    assert answered([copy], [one], answers) == [code == 1]
    assert answered([copy], [one], answers) == [code == 1]
    assert len(ran) == len(first)
    with (copy / changed).open("a") as file:
        file.write("\n# longer\n")
    assert answered([copy], [one], answers) == [counts]
    assert len(answers.read_text().splitlines()) == (1 if counts else 2)


def test_the_test_that_saw_a_fault_before_runs_first(copy, monkeypatch, tmp_path):
    monkeypatch.setitem(globals(), "FAILED", "FAILED tests/shop/test_all.py::test_all - assert 4 == 1\n")
    ran, answers = _exits(monkeypatch, 0, 0, 1, 0, 1), tmp_path / "answers.jsonl"
    assert answered([copy], [_doubles(copy)], answers) == [True]
    with (copy / "tests/shop/test_all.py").open("a") as file:
        file.write("\n# longer\n")
    assert answered([copy], [_doubles(copy)], answers) == [True]
    assert ran[1:3] == [["test_half.py"], ["shop"]]
    assert ran[4:] == [["test_all.py"]]


def test_what_was_compiled_is_kept_but_for_the_module_and_all_that_import_it(tmp_path):
    one = Mutation("registration", "pipeline/registration/residual.py", "core/NumberReplacer", 0, 1, "")
    names = ["registration_1f/residual.a-1.nbc", "registration_1f/loop.b-2.nbi", "kernels_2e/trees.c-3.nbi"]
    for name in names:
        (tmp_path / testing.SOUND / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / testing.SOUND / name).touch()
    testing._keep_compiled(tmp_path, one)
    kept = (tmp_path / testing.FAULTY).rglob("*.nb?")
    assert [path.relative_to(tmp_path / testing.FAULTY).as_posix() for path in kept] == names[2:]


def test_a_mutant_that_is_known_to_change_no_result_is_not_tested(copy, monkeypatch, tmp_path):
    one = _doubles(copy)
    monkeypatch.setattr("lab.mutants.__main__.reasons", lambda: Reasons({one.place: "The same."}, {}))
    assert not _exits(monkeypatch)
    assert answered([copy], [one], tmp_path / "answers.jsonl") == [False]


def test_reasons_belong_to_a_source_line_and_equivalent_mutants_are_counted_apart():
    same = Mutation("mac", "shop/half.py", "core/NumberReplacer", 0, 1, "LIMIT = 3 | 4")
    others = [replace(same, occurrence=k, line=k) for k in range(2, 6)]
    moved = replace(same, source="LIMIT = 5", line=9)
    seen = [False, True, True, True, False, False]
    score = Score(
        300, [same, *others, moved], seen, Reasons({same.place: "The same."}, {others[-1].place: "Rare."})
    )
    assert score.share == 3 / 5
    text = page(score, 7)
    assert '`make mutants ARGS="--count 300 --seed 7"` plants 300 faults' in text
    assert (
        "Tested so far: 6. Seen: 3 of 6 (50.0%). Without the equivalent mutants (1): 3 of 5 (60.0%)." in text
    )
    assert "| mac | 6 | 3 | 1 |" in text
    assert r"| line 1, `LIMIT = 3 \| 4`: `shop/half.py NumberReplacer 0` | yes | The same. |" in text
    assert "`shop/half.py NumberReplacer 5` | no | Rare. |" in text
    assert "| line 9, `LIMIT = 5`: `shop/half.py NumberReplacer 0` | no |  |" in text


def test_the_stored_reasons_have_the_form_of_places():
    whys = json.loads(WHYS.read_text())
    assert whys.keys() == {"equivalent", "other"}
    for place in whys["equivalent"] | whys["other"]:
        assert re.match(r"\w+(/\w+)+\.py \w+ \d+: \S", place)
