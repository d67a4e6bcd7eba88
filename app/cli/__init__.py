"""The command line: one file a command; heavy imports happen inside the command that needs them.

Exit code 0: done; 1: it could not be done, one sentence says why; 2: wrong use.
With ``--json`` exactly one JSON object goes to stdout; everything else goes to stderr.
"""

from __future__ import annotations


def main(argv: list[str] | None = None) -> None:
    """Run one command and exit with its code.

    Computing processes import this module, as the main one of the program, and no command: hence no other
    import above.
    """
    from app.cli.commands import run

    run(argv)
