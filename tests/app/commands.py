"""A command as a user gives it, and what it has to say of what cannot be."""

import re

from app.cli import main


def run(capsys, *argv: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr."""
    try:
        main([*map(str, argv)])
        code = 0
    except SystemExit as stop:
        code = int(stop.code or 0)
    out, err = capsys.readouterr()
    return code, out, err


def shares(said: str) -> list[int]:
    """The per cents at the beginnings of the lines on stderr, in their order."""
    return [int(found) for found in re.findall(r"^ *(\d+)%  ", said, re.MULTILINE)]


def check_one_sentence(got: tuple[int, str, str], code: int, says: str) -> None:
    """Nothing on stdout, and after what was done until then one sentence."""
    assert got[0] == code
    assert got[1] == ""
    sentences = [line for line in got[2].splitlines() if line.startswith("packetmesh: ")]
    assert sentences == got[2].splitlines()[-1:]
    assert says in sentences[0]
    assert "Traceback" not in got[2]
