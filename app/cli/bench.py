"""``packetmesh bench``: speed and memory beside peers."""

from __future__ import annotations

from pathlib import Path

from app.cli.text import print_json, say


def bench(out: Path, only: tuple[str, ...] = (), json: bool = False) -> None:
    """Measure speed and memory beside peers, in one run.

    Args:
        out: Folder for bench.json.
        only: Cases to run, or what stands before their colons, as `chain,network`; all without it.
        json: Print the results as one JSON object.
    """
    from lab.benchmarks import run_benchmarks
    from packetmesh.files import writable_folder, write_json

    writable_folder(out)
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
