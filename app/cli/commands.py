"""The commands by name, and the function that runs one and exits with its code."""

from __future__ import annotations

import logging
import os
import sys
from typing import Any

import tyro

from app.cli.bench import bench
from app.cli.calibrate import calibrate
from app.cli.deliver import deliver
from app.cli.doctor import doctor
from app.cli.import_rig import import_rig
from app.cli.infer_depth import infer_depth
from app.cli.lesson import lesson
from app.cli.measure import measure
from app.cli.mesh import mesh
from app.cli.plan import plan
from app.cli.reconstruct import reconstruct
from app.cli.register import register
from app.cli.repeated import joined, with_negative_places
from app.cli.reproduce import reproduce
from app.cli.scenes import scenes
from app.cli.serve import serve
from app.cli.simulate import simulate
from app.cli.target import target
from app.cli.text import say
from packetmesh.errors import PacketMeshError
from packetmesh.files import file_trouble

COMMANDS: dict[str, Any] = {
    "serve": serve,
    "reconstruct": reconstruct,
    "import": import_rig,
    "calibrate": calibrate,
    "target": target,
    "register": register,
    "mesh": mesh,
    "measure": measure,
    "plan": plan,
    "infer-depth": infer_depth,
    "simulate": simulate,
    "deliver": deliver,
    "lesson": lesson,
    "reproduce": reproduce,
    "bench": bench,
    "scenes": scenes,
    "doctor": doctor,
}


def run(argv: list[str] | None) -> None:
    """Run one command, and exit with its code."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    try:
        tyro.extras.subcommand_cli_from_dict(
            COMMANDS,
            prog="packetmesh",
            description="From a camera node's packets to a surface mesh.",
            args=with_negative_places(joined(sys.argv[1:] if argv is None else argv)),
            config=(tyro.conf.FlagCreatePairsOff,),
        )
        sys.stdout.flush()
    except BaseException as error:
        if _interrupted(error):
            say("; ".join(["packetmesh: stopped", *getattr(error, "__notes__", ())]))
            sys.exit(130)
        if isinstance(error, BrokenPipeError):  # the reader of the output has gone
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(1)
        sentence = _sentence(error)
        if sentence is None:
            raise
        say(f"packetmesh: {sentence}")
        sys.exit(1)


def _interrupted(error: BaseException | None) -> bool:
    """Return whether an error is Ctrl-C, or was raised because of it.

    Compiled code raises another error: numba a SystemError when Ctrl-C stops it while it loads a kernel.
    """
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _sentence(error: BaseException) -> str | None:
    """Return what an error says to the user; None for an error of the program."""
    match error:
        case PacketMeshError():
            return str(error)
        case MemoryError():
            return f"There is not enough memory ({error}); try fewer images or nodes, or a shorter run"
        case OSError():
            return file_trouble(error)
    return None
