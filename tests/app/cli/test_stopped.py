"""Ctrl-C in the command line."""

import pytest

from app.cli import commands
from tests.app.commands import check_one_sentence, run


def interrupted(*notes):
    error = KeyboardInterrupt()
    for note in notes:
        error.add_note(note)
    raise error


def wrapped():
    """As numba does while it loads a kernel."""
    try:
        interrupted()
    except KeyboardInterrupt as error:
        raise SystemError("<function _numba_unpickle> returned a result with an exception set") from error


def in_a_handler():
    try:
        interrupted()
    except KeyboardInterrupt:
        raise OSError("cannot be written")  # noqa: B904


@pytest.mark.parametrize("stop", [interrupted, wrapped, in_a_handler])
def test_ctrl_c_is_one_sentence_whatever_it_became(capsys, monkeypatch, stop):
    monkeypatch.setattr(commands, "COMMANDS", {"scenes": stop, "doctor": stop})
    check_one_sentence(run(capsys, "scenes"), 130, "packetmesh: stopped")


def test_ctrl_c_says_what_is_kept(capsys, monkeypatch):
    def stop():
        interrupted("the same command goes on with the rigs that are left")

    monkeypatch.setattr(commands, "COMMANDS", {"scenes": stop, "doctor": stop})
    check_one_sentence(run(capsys, "scenes"), 130, "stopped; the same command goes on")


def test_an_error_of_the_program_is_raised(monkeypatch):
    def fail():
        raise SystemError("not by Ctrl-C")

    monkeypatch.setattr(commands, "COMMANDS", {"scenes": fail, "doctor": fail})
    with pytest.raises(SystemError, match="not by Ctrl-C"):
        commands.run(["scenes"])
