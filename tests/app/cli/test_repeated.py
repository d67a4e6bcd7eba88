"""Options that are given more than once keep all their values."""

import pytest

from app.cli.repeated import joined


@pytest.mark.parametrize(
    ("given", "parsed"),
    [
        ("simulate --set a=1 b=2 --json", "simulate --set a=1 b=2 --json"),
        ("simulate --set a=1 --json --set b=2 c=3", "simulate --json --set a=1 b=2 c=3"),
        ("simulate --set=a=1 --set=b=2 --seed 3", "simulate --seed 3 --set a=1 b=2"),
        ("deliver --down x --set a=1 --down y z", "deliver --set a=1 --down x y z"),
        ("serve --allow-host a --allow-host b", "serve --allow-host a --allow-host b"),
        ("", ""),
    ],
)
def test_all_values_stand_after_the_last_occurrence(given, parsed):
    assert joined(given.split()) == parsed.split()
