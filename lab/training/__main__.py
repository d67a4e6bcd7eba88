"""``python -m lab.training``: render or trace rooms; train, export and evaluate networks."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from lab.training.completion.config import CompletionConfig
from lab.training.config import WIDTHS, TrainingConfig
from packetmesh.errors import PacketMeshError

if TYPE_CHECKING:
    from lab.training.furniture import Catalogue


@dataclass(frozen=True, slots=True)
class Rooms:
    """Rooms to render, and their furniture."""

    data: Path
    """Folder of the shards."""
    split: Literal["train", "validation", "test"] = "train"
    first: int = 0
    """First shard of ten rooms."""
    last: int = 10
    """One past the last shard."""
    furniture: Path | None = None
    """Sweet Home 3D's furniture: a folder or a .deb file."""
    cache: Path | None = None
    """Folder for prepared furniture, kept between runs."""

    def catalogue(self) -> Catalogue | None:
        """Return the catalogue that furnishes the rooms of the split; None for procedural pieces."""
        from lab.training.furniture import Catalogue

        if self.furniture is None:
            return None
        return Catalogue.open(self.furniture, self.cache).of_split(self.split)


def render(rooms: Rooms) -> None:
    """Render rooms into shards, and print the file of each finished shard."""
    from lab.training.dataset import render_shards

    for file in render_shards(rooms.data, rooms.split, rooms.first, rooms.last, rooms.catalogue()):
        print(file, flush=True)


def trace(rooms: Rooms, blender: Path, samples: int = 16, threads: int = 1) -> None:
    """Path-trace rooms into shards, and print the file of each finished shard.

    Args:
        rooms: rooms to render, and their furniture.
        blender: Python interpreter that has bpy.
        samples: light paths per pixel, before denoising.
        threads: threads that render.
    """
    from lab.training.blend import render_traced

    which = rooms.data, rooms.split, rooms.first, rooms.last
    for file in render_traced(*which, blender, samples, threads, rooms.catalogue()):
        print(file, flush=True)


def train(config: TrainingConfig) -> None:
    """Train until a time budget is spent, or continue a training."""
    from lab.training.train import train

    train(replace(config, width=config.width or WIDTHS[config.initial]))


def export(checkpoint: Path, data: Path, out: Path) -> None:
    """Write the ONNX file of a checkpoint, and print the errors of the 8-bit and the floating-point file.

    Args:
        checkpoint: best.pt or last.pt of a training run.
        data: folder of the shards.
        out: the ONNX file.
    """
    from lab.training.export import export

    print(export(checkpoint, data, out))


def train_completion(config: CompletionConfig) -> None:
    """Train a network that completes a sensor's depth, until the time budget is spent."""
    from lab.training.completion.train import train_completion

    train_completion(config)


def export_completion(checkpoint: Path, out: Path) -> None:
    """Write the ONNX file of a completion network, and print its size.

    Args:
        checkpoint: last.pt of a training run.
        out: the ONNX file.
    """
    from lab.training.completion.export import export_completion

    print(f"{out}: {export_completion(checkpoint, out) / 1e6:.1f} MB")


def fit_confidence(rooms: int = 120) -> None:
    """Fit the confidence of aligned and completed depth on validation rooms, and print its calibration.

    Args:
        rooms: how many; half of them fit, half of them judge.
    """
    from lab.training.completion.fit import fit_confidence

    for line in fit_confidence(rooms):
        print(line, flush=True)


def evaluate(model: Path | None = None, real: Path | None = None, rooms: int = 60) -> None:
    """Print a network's errors; needs no torch.

    Args:
        model: ONNX file; without it, the one that ships.
        real: folder of folders with real RGB-D frames.
        rooms: number of held-out rooms.
    """
    from lab.training.evaluate import evaluate

    for line in evaluate(model, real, rooms):
        print(line, flush=True)


def main() -> None:
    """Parse the command line and run one step of making a network."""
    commands = (render, trace, train, train_completion, export, export_completion, fit_confidence, evaluate)
    steps = {step.__name__: step for step in commands}
    try:
        tyro.extras.subcommand_cli_from_dict(
            steps, prog="python -m lab.training", config=(tyro.conf.OmitArgPrefixes,)
        )
    except PacketMeshError as error:
        print(error, file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
