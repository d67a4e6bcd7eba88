"""Tasks on this machine's cores: all of them, once, as they end; errors come through."""

import math
import os
import sys

import pytest

from packetmesh.batch import run_batch
from packetmesh.errors import InputError

PROCESS = "__import__('os').getpid()"


def test_every_task_is_done_once():
    answers = dict(run_batch(abs, [-3, 4, -5, 0]))
    assert answers == {0: 3, 1: 4, 2: 5, 3: 0}


def test_no_task_gives_nothing():
    assert list(run_batch(abs, [])) == []


def test_a_single_task_stays_in_this_process():
    assert list(run_batch(eval, [PROCESS])) == [(0, os.getpid())]


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="needs two cores")
def test_several_tasks_go_to_other_processes():
    assert os.getpid() not in dict(run_batch(eval, [PROCESS] * 4)).values()


def test_an_error_of_a_task_is_the_batch_s():
    with pytest.raises(ValueError, match="math domain error"):
        list(run_batch(math.sqrt, [1.0, -1.0]))


def test_stopping_early_drops_what_has_not_begun():
    answers = run_batch(abs, list(range(50)))
    next(answers)
    answers.close()


def test_a_scheduler_that_is_not_there_is_one_sentence():
    pytest.importorskip("distributed", reason="needs the package distributed")
    with pytest.raises(InputError, match="no Dask scheduler at nowhere://1"):
        list(run_batch(abs, [1], "nowhere://1"))


def test_a_cluster_without_the_package_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match="packetmesh\\[cluster\\]"):
        list(run_batch(abs, [1], "tcp://127.0.0.1:9"))
