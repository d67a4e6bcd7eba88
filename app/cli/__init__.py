"""The command line, one file per command; heavy imports are inside the command that needs them.

Exit codes: 0 for success; 1 for a failure, with one sentence on its cause; 2 for wrong use. With ``--json``
exactly one JSON object goes to stdout; everything else goes to stderr.
"""

from __future__ import annotations


def main(argv: list[str] | None = None) -> None:
    """Run one command and exit with its code.

    Computing processes import this module as the program's main module and need no command, so nothing else
    is imported above.
    """
    from app.cli.commands import run

    run(argv)
