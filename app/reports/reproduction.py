"""The report of the thesis's claims compared with our own numbers, and of our further claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from app.reports.exhibits import exhibit_html
from app.reports.html import table, text, write_page
from app.web.markup import Markup
from lab.claims.claim import VERDICTS, Verdict

MARKS = {
    **dict.fromkeys(("reproduced", "holds"), "reproduced"),
    **dict.fromkeys(("not reproduced", "does not hold"), "not-reproduced"),
}
"""Classes of the page's style; other verdicts are neutral."""
IN_POINTS = ("D01", "D04", "D05", "D07", "D08")
"""Claims whose F-scores and shares of rays are in points."""


def write_reproduction_report(verdicts: Sequence[Verdict], path: Path) -> None:
    """Write one self-contained HTML page with every claim, its verdict and its numbers."""
    ours = [verdict for verdict in verdicts if verdict.beyond]
    thesis = [verdict for verdict in verdicts if not verdict.beyond]
    body = Markup(
        '<h1>The claims of the thesis, computed again</h1><p class="lead">{}</p>'
        '<p class="note">Shares run from 0 to 1, lengths are in metres; intervals are 95 %: by '
        "bootstrap, of the mean over frames or of the median over rooms, and by Student's t over independent "
        "runs of the network.</p>{}"
    ).format(_verdict_counts(thesis), Markup("").join(map(_section, thesis)))
    if ours:
        body += Markup('<h1>Our claims beyond the thesis</h1><p class="lead">{}</p>{}{}').format(
            _verdict_counts(ours), _points_note(ours), Markup("").join(map(_section, ours))
        )
    write_page(path, "PacketMesh: the thesis, computed again", body)


def _verdict_counts(verdicts: Sequence[Verdict]) -> str:
    """Return the number of claims with each verdict."""
    counts = Counter(verdict.verdict for verdict in verdicts)
    parts = (f"{count} {word}" for word in VERDICTS if (count := counts[word]))
    return f"Claims: {', '.join(parts)}."


def _points_note(verdicts: Sequence[Verdict]) -> Markup:
    """Return a note that names the verdicts whose claims are of ``IN_POINTS``; empty without one."""
    named = ", ".join(verdict.id for verdict in verdicts if verdict.id in IN_POINTS)
    note = Markup('<p class="note">In points of 100: F-scores, shares of rays and their changes in {}.</p>')
    return note.format(named) if named else Markup("")


def _section(verdict: Verdict) -> Markup:
    mark = MARKS.get(verdict.verdict, "")
    judged = "It holds if" if verdict.beyond else f"The thesis: {verdict.thesis}. Test"
    rows = []
    for name, value in verdict.ours.items():
        low, high = verdict.ci95.get(name, (None, None))
        rows.append((name.replace("_", " "), value, "" if low is None else f"{text(low)} to {text(high)}"))
    return Markup(
        '<h2>{} <span class="{}">{}</span></h2><p>{}. {}: {}.</p><p><b>Ours:</b> {}.</p>{}{}'
    ).format(
        verdict.id,
        mark,
        verdict.verdict,
        verdict.claim,
        judged,
        verdict.tolerance,
        verdict.why,
        table(("measured", "value", "95 % interval"), rows) if rows else "",
        Markup("").join(map(exhibit_html, verdict.exhibits)),
    )
