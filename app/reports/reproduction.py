"""The report of the thesis's claims beside our own numbers."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from app.reports.exhibits import exhibit_html
from app.reports.html import table, write_page
from lab.claims.claim import Verdict


def write_reproduction_report(verdicts: Sequence[Verdict], path: Path) -> None:
    """Write one self-contained HTML page with every claim, its verdict and the numbers behind it."""
    reproduced = sum(verdict.verdict == "reproduced" for verdict in verdicts)
    body = (
        "<h1>The thesis, computed again</h1>"
        f'<p class="lead">{reproduced} of {len(verdicts)} claims reproduced.</p>'
        '<p class="note">Shares run from 0 to 1, lengths are in metres; intervals are 95 %: by '
        "bootstrap, of the mean over frames or of the median over rooms, and by Student's t over independent "
        "runs of the network.</p>"
    )
    write_page(path, "PacketMesh: the thesis, computed again", body + "".join(map(_section, verdicts)))


def _section(verdict: Verdict) -> str:
    mark = verdict.verdict.replace(" ", "-")
    rows = []
    for name, value in verdict.ours.items():
        low, high = verdict.ci95.get(name, (None, None))
        rows.append((name.replace("_", " "), value, "" if low is None else f"{low:.4g} to {high:.4g}"))
    return (
        f'<h2>{escape(verdict.id)} <span class="{mark}">{escape(verdict.verdict)}</span></h2>'
        f"<p>{escape(verdict.claim)}. The thesis: {escape(verdict.thesis)}. "
        f"Counts as reproduced: {escape(verdict.tolerance)}.</p><p><b>Ours:</b> {escape(verdict.why)}.</p>"
        + table(("measured", "value", "95 % interval"), rows)
        + "".join(map(exhibit_html, verdict.exhibits))
    )
