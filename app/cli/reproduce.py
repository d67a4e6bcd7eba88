"""``packetmesh reproduce``: the thesis's claims compared with our results."""

from __future__ import annotations

from pathlib import Path

from app.cli.text import print_json, say, say_progress


def reproduce(
    out: Path,
    only: tuple[str, ...] = (),
    scheduler: str | None = None,
    full: bool = False,
    json: bool = False,
) -> None:
    """Compute the claims of the thesis and compare our numbers with its own; then our claims beyond it.

    Args:
        out: Folder for reproduce.html and reproduce.json. It keeps the trials, so an interrupted run
            resumes.
        only: Claims to compute (`--only C10 C16` or `--only C10,C16`); all by default.
        scheduler: Address of a Dask scheduler that runs the trials; without it, this machine's cores do.
        full: Also run the trials of the delivery claims (D01 to D07) that are left out by default; takes
            hours.
        json: Print the verdicts as one JSON object.
    """
    from app.reports.reproduction import write_reproduction_report
    from lab.claims.registry import run_claims
    from packetmesh.files import writable_folder, write_json
    from packetmesh.progress import Progress

    writable_folder(out)
    verdicts = {}
    names = [name for names in only for name in names.split(",")]
    for event in run_claims(names, out / "trials", scheduler, full):
        if isinstance(event, Progress):
            say_progress(event)
            continue
        say(f"{event.id}  {event.verdict}: {event.why}")
        verdicts[event.id] = event
    report = {key: verdict.record() for key, verdict in verdicts.items()}
    write_json(out / "reproduce.json", report)
    write_reproduction_report(list(verdicts.values()), out / "reproduce.html")
    if json:
        print_json(report)
