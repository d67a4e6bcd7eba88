"""The commands behind the records, and the parts of their results that are stored."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

from lab.claims.depth.scenes import DATA, DATA_VARIABLE, real_folders
from lab.results.record import Record, committed_code, new_record
from lab.trials import ROOT
from packetmesh.errors import InputError, PacketMeshError
from pipeline.config import PRESETS
from pipeline.io.demos import CALIBRATED_SCENES

COMMANDS: dict[str, tuple[str, ...]] = {
    "calibration_claims": (
        *("packetmesh", "reproduce", "--only"),
        "C01,C02,C03,C04,C05,C06,C07,C08",
    ),
    "board_claims": ("packetmesh", "reproduce", "--only", "C25,D09"),
    "setting_claims": ("packetmesh", "reproduce", "--only", "C09,C11,C15,C37,C38,C39"),
    "outlier_claims": ("packetmesh", "reproduce", "--only", "C10"),
    "depth_claims": ("packetmesh", "reproduce", "--only", "C12,C13,C14"),
    "fill_claims": ("packetmesh", "reproduce", "--only", "D10"),
    "registration_claims": ("packetmesh", "reproduce", "--only", "C16,C17,C18,C19,C20"),
    "surface_claims": ("packetmesh", "reproduce", "--only", "C21,C22,C23,C24"),
    "network_claims": (
        *("packetmesh", "reproduce", "--only"),
        "C26,C27,C28,C29,C30,C31,C32,C33,C34,C35,C36",
    ),
    "delivery_claims": ("packetmesh", "reproduce", "--only", "D01,D02,D03,D04,D05,D06,D07,D08,D11"),
    "bench_chain": ("packetmesh", "bench", "--only", "chain"),
    "bench_surface": ("packetmesh", "bench", "--only", "surface"),
    "bench_registration": ("packetmesh", "bench", "--only", "registration"),
    "bench_problems": ("packetmesh", "bench", "--problems", "runs/problems"),
    "bench_places": ("packetmesh", "bench", "--only", "places"),
    "bench_recording": ("packetmesh", "bench", "--only", "recording"),
    "bench_measuring": ("packetmesh", "bench", "--only", "measuring"),
    "bench_depth": ("packetmesh", "bench", "--only", "depth"),
    "bench_codings": ("packetmesh", "bench", "--only", "codings"),
    "bench_network": ("packetmesh", "bench", "--only", "network"),
    "between_cameras": ("python", "-m", "lab.between_cameras", "--rooms", "20", "--json"),
    "tile_worth": ("python", "-m", "lab.worth", "--rooms", "20", "--random", "--json"),
    "planning": ("python", "-m", "lab.planning", "--skip", "60"),
    "real_frames": ("python", "-m", "lab.benchmarks.real_frames"),
    "calibration_verdicts": ("python", "-m", "lab.verdicts", "--seed", "2026", "--sessions", "400"),
    "ns3_saturation": ("python", "tests/benchmarks/ns3_saturation.py"),
}
"""Command of each record; ``bench_problems`` and ``bench_places`` need lists in runs/problems, written there
by ``python -m lab.benchmarks.problem_lists runs/problems --lidar DATA``, and ``ns3_saturation`` needs
ns-3."""
RECONSTRUCT = "reconstruct"
RECORDS = (RECONSTRUCT, *COMMANDS)
PROGRAMS = {"packetmesh": (sys.executable, "-m", "app.cli"), "python": (sys.executable,)}
SURFACE_KEYS = ("measured", "surface_before", "surface_after", "truth")
VERDICT_KEYS = ("claim", "thesis", "tolerance", "verdict", "why", "ours", "ci95")


def measure(name: str, runs: Path = Path("runs/results")) -> Record:
    """Run the command of a record and return the record; a command takes seconds to an hour.

    Args:
        name: a name of ``RECORDS``.
        runs: folder for the commands' output; claims store their trials there, so that an interrupted run
            resumes.

    Raises:
        InputError: there is no such record, or the code is not committed.
        PacketMeshError: the command failed.
    """
    if name != RECONSTRUCT and name not in COMMANDS:
        raise InputError(f"There is no record '{name}'; known are {', '.join(RECORDS)}")
    commit = committed_code()
    if name == RECONSTRUCT:
        return new_record(name, f"make results-record ONLY={name}", commit, _reconstructions(runs))
    words = COMMANDS[name]
    if words[0] == "packetmesh":
        words = (*words, "--out", f"{runs / name}")
    if not any(word.startswith("lab.") for word in words):  # these print nothing but JSON
        words = (*words, "--json")
    answer = _run(words)
    if "reproduce" in words:
        answer = {claim: _verdict(verdict) for claim, verdict in answer.items()}
    elif "--problems" in words:
        answer = {"summary": answer["summary"]}
    elif "bench" in words:
        answer = {case: {k: v for k, v in result.items() if k != "notes"} for case, result in answer.items()}
    return new_record(name, shlex.join(words), commit, answer)


def _reconstructions(runs: Path) -> dict[str, Any]:
    """Reconstruct every calibrated demo scene and every real frame on this machine, with each preset."""
    sources = {scene: ["--scene", scene] for scene in CALIBRATED_SCENES}
    for folder in real_folders():
        files = {"color": "color.png", "depth": "depth.png", "intrinsics": "intrinsics.json"}
        place = f"${DATA_VARIABLE}/{folder.name}"
        sources[folder.name] = [
            word for key, file in files.items() for word in (f"--{key}", f"{place}/{file}")
        ]
    return {
        title: {preset: _reconstruction(source, preset, runs / f"{title}-{preset}") for preset in PRESETS}
        for title, source in sources.items()
    }


def _reconstruction(source: list[str], preset: str, out: Path) -> dict[str, Any]:
    words = ("packetmesh", "reconstruct", *source, "--preset", preset, "--out", str(out), "--json")
    metrics = _run(words)
    return {"command": " ".join(words)} | {key: metrics[key] for key in SURFACE_KEYS}


def _verdict(verdict: dict[str, Any]) -> dict[str, Any]:
    """Return a verdict with its tables, without its curves and pictures."""
    tables = [exhibit for exhibit in verdict["exhibits"] if "header" in exhibit]
    return {key: verdict[key] for key in VERDICT_KEYS} | {"tables": tables}


def _run(words: tuple[str, ...]) -> dict[str, Any]:
    """Run a command and return the JSON that it prints; its progress goes to standard error."""
    data = os.environ.get(DATA_VARIABLE, str(DATA))
    program, *arguments = (word.replace(f"${DATA_VARIABLE}", data) for word in words)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [*PROGRAMS[program], *arguments], cwd=ROOT, env=environment, stdout=subprocess.PIPE, check=False
    )
    if done.returncode:
        raise PacketMeshError(f"`{shlex.join(words)}` failed with exit code {done.returncode}")
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer
