"""``packetmesh reproduce``: the thesis's claims beside ours."""

from __future__ import annotations

from pathlib import Path

from app.cli.text import print_json, say


def reproduce(out: Path, only: tuple[str, ...] = (), json: bool = False) -> None:
    """Compute the thesis's claims anew and set them beside its own numbers.

    Args:
        out: Folder for reproduce.html and reproduce.json; keeps the trials of an interrupted run.
        only: Claims to compute (`--only C10 C16` or `--only C10,C16`); all without it.
        json: Print the verdicts as one JSON object.
    """
    from app.reports.reproduction import write_reproduction_report
    from lab.claims import run_experiments
    from packetmesh.files import writable_folder, write_json
    from packetmesh.progress import Progress

    writable_folder(out)
    verdicts = {}
    names = [name for names in only for name in names.split(",")]
    for event in run_experiments(names, out / "trials"):
        if isinstance(event, Progress):
            say(f"{event.fraction:4.0%}  {event.stage}")
            continue
        say(f"{event.id}  {event.verdict}: {event.why}")
        verdicts[event.id] = event
    report = {key: verdict.record() for key, verdict in verdicts.items()}
    write_json(out / "reproduce.json", report)
    write_reproduction_report(list(verdicts.values()), out / "reproduce.html")
    if json:
        print_json(report)
