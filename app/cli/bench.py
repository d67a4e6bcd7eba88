"""``packetmesh bench``: speed and memory, compared with other programs."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.cli.text import print_json, say, say_progress

if TYPE_CHECKING:
    from lab.benchmarks.benchmark import Benchmark


def bench(
    out: Path,
    only: tuple[str, ...] = (),
    problems: Path | None = None,
    recording: Path | None = None,
    load_s: float = 60.0,
    json: bool = False,
) -> None:
    """Measure speed and memory of PacketMesh and of other programs, in one run.

    Args:
        out: Folder for bench.json; for problems.json and problems.csv with `--problems`, for recording.json
            with `--recording`.
        only: Cases to run, or groups (the text before the colon), for example `chain,network`; all by
            default.
        problems: Solve registration problems instead: a folder of lists and clouds in the form of the
            point-clouds-registration-benchmark (arXiv 2003.12841); problems.csv gets a row for each problem
            and method.
        recording: Follow the camera of a recording instead, by ours and by other programs: a folder of TUM,
            7-Scenes or another form that has poses, which are the truth and no program gets.
        load_s: Duration of the cases `load` and `soak`, which run thirty browsers, in seconds; `load` then
            lets thirty look at one surface behind a line of 20 Mbit/s, which takes some minutes.
        json: Print the results as one JSON object.
    """
    from lab.benchmarks import CASES, run_benchmarks
    from packetmesh.files import writable_folder, write_json

    writable_folder(out)
    if problems is not None:
        report = _solve(problems, out)
        write_json(out / "problems.json", report)
        if json:
            print_json(report)
        return
    if recording is not None:
        from lab.benchmarks.recording import compared

        followed = compared([recording], 1, out / "recordings")
        for note in followed.notes:
            say(note)
        write_json(out / "recording.json", followed.record())
        if json:
            print_json(followed.record())
        return
    served = {kind: partial(_browsers, kind, load_s) for kind in ("load", "soak")}
    results = {}
    case_names = [name for names in only for name in names.split(",")]
    for case, result in run_benchmarks(case_names, CASES | served):
        peers = ", ".join(f"{name} {seconds:.3f} s" for name, seconds in result.peers.items()) or "no peer"
        peak_bytes = result.peak_memory_bytes
        memory = "" if peak_bytes is None else f", {peak_bytes / 1e6:.0f} MB at most"
        say(f"{case}: {result.ours_s:.3f} s ({peers}){memory}")
        for note in result.notes:
            say(f"  {note}")
        results[case] = result.record()
    write_json(out / "bench.json", results)
    if json:
        print_json(results)


def _solve(folder: Path, out: Path) -> dict[str, object]:
    """Solve every problem below a folder. Returns the rows and their summary."""
    from lab.benchmarks.problems import iterate_problems, summary
    from packetmesh.files import write_rows
    from packetmesh.progress import drain

    rows = drain(iterate_problems(folder, out / "trials"), say_progress)
    write_rows(out / "problems.csv", rows)
    groups = summary(rows)
    for group in groups:
        seconds = "no answer" if group["median_s"] is None else f"{group['median_s']:.3f} s"
        say(
            f"{group['list']:<16} {group['method']:<18} {group['solved_share']:>4.0%} of {group['problems']}"
            f" solved, error {group['median_error']:.4f} (median), {group['upper_quartile_error']:.4f}"
            f" (upper quartile), {seconds}"
        )
    return {"summary": groups, "problems": rows}


def _browsers(kind: Literal["load", "soak"], seconds: float) -> Benchmark:
    """Run the load test of thirty browsers; its time is the median from a click to its answer, NaN if none
    was answered.
    """
    from app.load.classroom import ClassTimes, time_class
    from app.load.load import put_load, soak
    from app.load.one_more import OneMore, work_for_one_more
    from lab.benchmarks.benchmark import Benchmark

    load = put_load(seconds) if kind == "load" else soak(seconds)
    record = load.record()
    parts: list[ClassTimes | OneMore] = []
    if kind == "load":
        parts = [time_class(by_name=True), time_class(by_name=False), work_for_one_more()]
    return Benchmark(
        record["answers_s"].get("median", math.nan),
        {},
        record["server_peak_bytes"] + record["workers_peak_bytes"],
        runs=(record, *(part.record() for part in parts)),
        notes=(*load.notes(), *(part.note() for part in parts)),
    )
