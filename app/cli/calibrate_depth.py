"""The part of ``packetmesh calibrate``'s output about a depth sensor."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipeline.calibration.from_images import CameraReport


def depth_lines(report: CameraReport) -> Iterator[str]:
    """Yield lines of text: doubts about the depth scale, then the sensor's bias or why it is unknown."""
    yield from report.depth_notes
    if report.depth is None:
        if report.depth_reason:
            yield f"The depth sensor's bias is not known. {report.depth_reason}"
        return
    fit, correction = report.depth, report.depth.correction
    yield (
        f"RMS depth error on the board, noise included: {1000.0 * fit.rms_before_m:.1f} mm measured, "
        f"{1000.0 * fit.rms_after_m:.1f} mm corrected; terms: {', '.join(fit.terms) or 'none'}"
    )
    for term, name in (("offset", "offset_m"), ("scale", "scale"), ("curvature", "curvature_per_m")):
        if term in fit.terms:
            low, high = correction.ci95[name]
            yield f"{term:>9} {getattr(correction, name):10.5g}   95 %: {low:.5g} to {high:.5g}"
    if fit.note:
        yield fit.note
