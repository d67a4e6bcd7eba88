"""Shares of kept measurements and closed rays in the chain, on real frames without ground truth.

``python -m lab.benchmarks.real_frames`` reconstructs every real frame next to the repository, and every image
with a known camera of the sets in ``PACKETMESH_DEPTH_SETS``: ``sr300``, from Debian's visp-images-data, and
``middlebury``. No network was trained on any of these frames.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from lab.claims.depth.scenes import load_real, named_sets, real_folders
from lab.datasets import open_set
from packetmesh.errors import InputError
from packetmesh.files import finite
from pipeline.config import PRESETS
from pipeline.reconstruct import reconstruct
from pipeline.types import DepthMap, RgbdFrame, Rig

MEASURES = (
    "kept_share",
    *("within_2pct_before", "within_2pct_after", "within_5pct_before", "within_5pct_after"),
    *("no_hit_before", "no_hit_after", "guessed_ray_share"),
)
"""Shares of the measured pixels, then of all rays."""


def frames_of(spec: str) -> Iterator[RgbdFrame]:
    """Yield the images of a set such as ``sr300=FOLDER``, with their measured depth.

    Raises:
        InputError: the camera of the set is not known.
    """
    for pair in open_set(spec):
        if pair.camera is None:
            raise InputError(f"Nothing says which camera took {pair.picture}; try sr300 or middlebury")
        yield RgbdFrame(pair.picture.stem, pair.rgb, DepthMap(pair.truth_m), pair.camera, np.eye(4))


def measured(frame: RgbdFrame) -> tuple[float, ...]:
    """Return ``MEASURES`` of one frame."""
    result = reconstruct(Rig(frame.name, (frame,)), PRESETS["packetmesh"])
    kept = result.kept
    return (
        kept.kept_share,
        *(kept.within_2pct_before, kept.within_2pct_after),
        *(kept.within_5pct_before, kept.within_5pct_after),
        *(surface.quality.no_hit_ray_share for surface in (result.before, result.after)),
        kept.guessed_ray_share,
    )


def summary(frames: Iterable[RgbdFrame]) -> dict[str, Any]:
    """Return means of ``MEASURES``, and the number of frames whose share near the measurement fell."""
    shares = np.array([measured(frame) for frame in frames])
    lower = (shares[:, 2] < shares[:, 1]) | (shares[:, 4] < shares[:, 3])
    means = dict(zip(MEASURES, shares.mean(axis=0).tolist(), strict=True))
    return {"frames": len(shares), **means, "lower_after": int(lower.sum())}


def main() -> None:
    """Print one JSON object with a summary for each set."""
    found = {}
    for folder in real_folders():
        found[folder.name] = summary((load_real(folder),))
    for spec in named_sets():
        found[spec.partition("=")[0].strip()] = summary(frames_of(spec))
    sys.stdout.write(f"{json.dumps(finite(found), allow_nan=False)}\n")


if __name__ == "__main__":
    main()
