"""What the chain keeps of measured depth, and what it closes, on real frames that have no truth.

``python tests/benchmarks/real_frames.py [KIND=FOLDER ...]`` reconstructs every real frame beside the
repository, and every picture of the sets named (``lab.datasets``; kinds that know their cameras: ``sr300``,
as Debian's visp-images-data has it, and ``middlebury``). One line a set: the share of measured pixels that
the outlier filter keeps, the share whose surface lies within 2 and within 5 % of the measurement before and
after fusion, rays without a surface before and after, rays that guesses close, and the frames in which fusion
made either share smaller. No network was trained on any of these frames.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from lab.claims.depth.scenes import load_real, real_folders
from lab.datasets import open_set
from packetmesh.errors import InputError
from pipeline.config import PRESETS
from pipeline.reconstruct import reconstruct
from pipeline.types import DepthMap, RgbdFrame, Rig

HEAD = ("set", "frames", "kept", "within 2 %", "within 5 %", "rays without", "guessed", "lower after")


def frames_of(spec: str) -> Iterator[RgbdFrame]:
    for pair in open_set(spec):
        if pair.camera is None:
            raise InputError(f"Nothing says which camera took {pair.picture}; try sr300 or middlebury")
        yield RgbdFrame(pair.picture.stem, pair.rgb, DepthMap(pair.truth_m), pair.camera, np.eye(4))


def measured(frame: RgbdFrame) -> tuple[float, ...]:
    result = reconstruct(Rig(frame.name, (frame,)), PRESETS["packetmesh"])
    kept = result.kept
    return (
        kept.kept_share,
        *(kept.within_2pct_before, kept.within_2pct_after),
        *(kept.within_5pct_before, kept.within_5pct_after),
        *(surface.quality.no_hit_ray_share for surface in (result.before, result.after)),
        kept.guessed_ray_share,
    )


def line(name: str, frames: Iterator[RgbdFrame]) -> tuple[str, ...]:
    shares = np.array([measured(frame) for frame in frames])
    lower = (shares[:, 2] < shares[:, 1]) | (shares[:, 4] < shares[:, 3])
    mean = 100.0 * shares.mean(axis=0)
    return (
        *(name, str(len(shares)), f"{mean[0]:.2f}"),
        *(f"{mean[start]:.1f} -> {mean[start + 1]:.1f}" for start in (1, 3, 5)),
        *(f"{mean[7]:.1f}", str(lower.sum())),
    )


def main() -> None:
    print(" | ".join(HEAD), "(means in per cent)")
    for folder in real_folders():
        print(" | ".join(line(folder.name, iter((load_real(folder),)))), flush=True)
    for spec in sys.argv[1:]:
        print(" | ".join(line(spec.rpartition("/")[2], frames_of(spec))), flush=True)


if __name__ == "__main__":
    main()
