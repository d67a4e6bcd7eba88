"""The report of a reconstruction counts holes as the app does."""

from __future__ import annotations

import re

import numpy as np

from app.reports.reconstruction import quality_tables
from pipeline.folders.run import surface_metrics
from pipeline.quality import Gaps, SurfaceQuality
from pipeline.types import SurfaceResult


def surface(share, gaps, rims, inside_m2):
    """A surface without triangles, but with these measures."""
    quality = SurfaceQuality(share, rims, 5.0, inside_m2, 0, 1, 3.0, 7, gaps=gaps)
    return SurfaceResult(np.zeros((0, 3)), np.zeros((0, 3), np.int32), quality=quality)


def test_the_holes_that_the_cameras_see_come_first_and_rims_are_folded_away():
    """As in the scene box on a table: less hole after fusion, in more and smaller pieces."""
    before, after = (
        surface(0.12, Gaps(40, 11, 0.59), 72, 0.1245),
        surface(0.03, Gaps(90, 2, 0.18), 193, 0.1259),
    )
    html = "".join(quality_tables(surface_metrics(before), surface_metrics(after)))
    first, rest = html.split("<details>")
    rows = {name: (old, new) for name, old, new in re.findall("<td>(.*?)</td>" * 3, first)}
    assert list(rows)[:3] == [
        "rays without a surface (%)",
        "area of the holes that the cameras see (m²)",
        "holes from 100 cm²",
    ]
    assert list(rows.values())[:3] == [("12", "3"), ("0.59", "0.18"), ("11", "2")]
    assert not any("rim" in name for name in rows)
    folded = {name: (old, new) for name, old, new in re.findall("<td>(.*?)</td>" * 3, rest)}
    assert folded["rims, of any length"] == ("72", "193")
    assert ("0.1245", "0.1259") in folded.values()
    assert "more rims" in rest
    assert rows.keys().isdisjoint(folded)
