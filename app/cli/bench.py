"""``packetmesh bench``: speed and memory beside peers."""

from __future__ import annotations

from pathlib import Path

from app.cli.text import print_json, say, say_progress


def bench(out: Path, only: tuple[str, ...] = (), problems: Path | None = None, json: bool = False) -> None:
    """Measure speed and memory beside peers, in one run.

    Args:
        out: Folder for bench.json.
        only: Cases to run, or what stands before their colons, as `chain,network`; all without it.
        problems: Solve registration problems instead: a folder of lists and clouds in the form of the
            point-clouds-registration-benchmark (arXiv 2003.12841); writes problems.csv, a row for each
            problem and method.
        json: Print the results as one JSON object.
    """
    from lab.benchmarks import run_benchmarks
    from packetmesh.files import writable_folder, write_json

    writable_folder(out)
    if problems is not None:
        report = _solve(problems, out)
        write_json(out / "problems.json", report)
        if json:
            print_json(report)
        return
    results = {}
    for case, result in run_benchmarks(name for names in only for name in names.split(",")):
        peers = ", ".join(f"{name} {seconds:.3f} s" for name, seconds in result.peers.items()) or "no peer"
        say(f"{case}: {result.ours_s:.3f} s ({peers}), {result.peak_memory_bytes / 1e6:.0f} MB at most")
        for note in result.notes:
            say(f"  {note}")
        results[case] = result.record()
    write_json(out / "bench.json", results)
    if json:
        print_json(results)


def _solve(folder: Path, out: Path) -> dict[str, object]:
    """The rows of every problem below a folder, and what they come to."""
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
