"""Text output of the command line."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from packetmesh.progress import Progress


def say(text: str) -> None:
    """Print a line on stderr, so that stdout holds only JSON and tables."""
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


def say_progress(progress: Progress) -> None:
    """Print the progress of a computation."""
    say(f"{progress.fraction:4.0%}  {progress.stage}")


def wrong_use(sentence: str) -> NoReturn:
    """Print what is wrong with the options, and exit with 2."""
    say(f"packetmesh: {sentence}")
    sys.exit(2)


def print_json(value: Any) -> None:
    """Print a value as strict JSON on one line of stdout (NaN and infinity become null)."""
    from packetmesh.files import finite

    sys.stdout.write(f"{json.dumps(finite(value), allow_nan=False)}\n")


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Return the rows of a table as text, each column as wide as its widest cell."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)
    return "\n".join(line.rstrip() for line in lines)


def answers_table(metrics: dict[str, dict[str, Any]]) -> str:
    """Return a table with a line per method, in centimetres and seconds."""
    lengths = ["rmse_m", "average_hausdorff_m", "point_error_m"]
    lengths = [name for name in lengths if all(name in row for row in metrics.values())]
    headings = [f"{name.removesuffix('_m').replace('_', ' ')} cm" for name in lengths]
    lines = [f"{'method':<20}" + "".join(f"{name:>22}" for name in ["iterations", "s", *headings])]
    for method, row in metrics.items():
        iterations = "-" if row["iterations"] is None else row["iterations"]
        values = [f"{row['elapsed_s']:.3f}", *(f"{100.0 * row[name]:.3f}" for name in lengths)]
        lines.append(f"{method:<20}{iterations:>22}" + "".join(f"{value:>22}" for value in values))
    return "\n".join(lines)


def mesh_lines(report: dict[str, Any]) -> str:
    """Return the quality of a mesh as text, in millimetres and seconds."""
    from pipeline.surface.boundary import LONGEST_HOLE_M

    closed = "" if report["genus"] is None else f", closed, genus {report['genus']}"
    sizes = ", ".join(f"{1000.0 * radius_m:.4g}" for radius_m in report["radii_m"])
    rows = {
        "width": f"{report['width_m']:.4g} m" + (" (doubtful: see above)" if report["unit_doubt"] else ""),
        "normals": report["normals"],
        "radii": f"{sizes} mm",
        "mesh": f"{report['triangles']} triangles of {report['vertices']} points{closed}",
        "unused": f"{report['unused_points']} of {report['points']} points",
        "rims": (
            f"{report['boundary_loops']}, {report['boundary_length_m']:.4g} m in all; the holes (rims under "
            f"{LONGEST_HOLE_M:g} m) cover {report['hole_area_m2']:.4g} m2, longer ones are outer rims"
        ),
        "connection": f"{report['components']} components, Euler number {report['euler']}, "
        f"{report['non_manifold_edges']} non-manifold edges",
        "time": f"{report['elapsed_s']:.1f} s",
        "file": report["out"],
    }
    return "\n".join(f"{name:<14} {value}" for name, value in rows.items())
