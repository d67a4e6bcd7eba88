"""The command line, one file per command; heavy imports are inside the command that needs them.

Exit codes: 0 for success; 1 for a failure, with one sentence on its cause; 2 for wrong use; 3 and 4 for the
verdicts of ``register`` that are not sure; 130 for Ctrl-C. With ``--json`` exactly one JSON value, an object
or a list, goes to stdout; everything else goes to stderr.
"""

from __future__ import annotations


def main(argv: list[str] | None = None) -> None:
    """Run one command and exit with its code.

    The commands are imported here and not above, because computing processes import this module as the
    program's main module and need no command.
    """
    from app.cli.commands import run

    run(argv)
