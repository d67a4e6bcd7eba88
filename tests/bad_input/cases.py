"""The table: every way in which a file can be bad, as cases that are made one by one."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from tests.bad_input.geometry import clouds, models
from tests.bad_input.images import images
from tests.bad_input.samples import Sample, samples
from tests.bad_input.texts import bags, numbers_in_text, unwanted_networks

UNNOTICED = ("traj.log: nan", "traj.log: inf", "traj.log: 1e999", "of_matlab.txt: 5 tenths")
"""Damage that is allowed: a recording has such poses where it lost its track, a camera may have no lens."""


@dataclass(frozen=True)
class Case:
    """A bad file."""

    name: str
    sample: Sample
    """Whose reader reads it, under whose name."""
    data: Callable[[], bytes]
    cut: bool = False
    """Whether it is the beginning of the good file."""
    may_open: bool = False
    """Whether no reader can notice: nothing in the file says what should be there."""


@cache
def cases() -> tuple[Case, ...]:
    """All of them."""
    kinds = {sample.name: sample for sample in samples()}
    found: list[Case] = []
    for sample in kinds.values():
        found += _cut(sample)
        found += _other_things(sample)
    for made in (clouds, models, images, numbers_in_text, unwanted_networks):
        for name, what, data in made():
            case = f"{name}: {what}"
            make = data if callable(data) else lambda data=data: data
            found.append(Case(case, kinds[name], make, may_open=case.startswith(UNNOTICED)))
    for name, what, data in bags():
        found.append(Case(f"{name}: {what}", kinds[name], lambda data=data: data, may_open=True))
    assert len({case.name for case in found}) == len(found)
    return tuple(found)


def _cut(sample: Sample) -> Iterator[Case]:
    """The file ends after each tenth of it."""
    for tenth in range(1, 10):
        data = sample.data[: len(sample.data) * tenth // 10]
        name = f"{sample.name}: {tenth} tenths of it"
        may_open = sample.ends_anywhere or name.startswith(UNNOTICED)
        yield Case(name, sample, lambda data=data: data, cut=True, may_open=may_open)


def _other_things(sample: Sample) -> Iterator[Case]:
    """What is no such file at all."""
    noise = np.random.default_rng(len(sample.name)).bytes(3000)
    for what, data in (
        ("empty", b""),
        ("zeros", bytes(3000)),
        ("noise", noise),
        ("a page of the web", b"<!DOCTYPE html>\n<html><head><title>404</title></head></html>\n" * 9),
        ("a pickle", pickle.dumps({"points": [1, 2, 3]})),
    ):
        yield Case(f"{sample.name}: {what}", sample, lambda data=data: data)
