"""``python -m lab.training render|trace|train|export|evaluate``."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from packetmesh.errors import PacketMeshError

if TYPE_CHECKING:
    from lab.training.initial import Initial
    from lab.training.network import Width


def main() -> None:
    """Parse the command line and run one step of making a network."""
    parser = argparse.ArgumentParser(prog="python -m lab.training", description=__doc__)
    steps = parser.add_subparsers(dest="step", required=True)
    add_room_options(steps.add_parser("render", help="render rooms into shards"))
    traced = steps.add_parser("trace", help="path-trace rooms into shards, by a Python that has bpy")
    add_room_options(traced)
    traced.add_argument("--blender", type=Path, required=True, help="that Python")
    traced.add_argument("--samples", type=int, default=16, help="light paths a pixel, before denoising")
    traced.add_argument("--threads", type=int, default=1)
    add_train_options(steps.add_parser("train", help="train until a time budget is spent"))
    export = steps.add_parser("export", help="write the ONNX file of a checkpoint")
    export.add_argument("--checkpoint", type=Path, required=True, help="best.pt or last.pt of a training run")
    export.add_argument("--data", type=Path, required=True)
    export.add_argument("--out", type=Path, required=True)
    evaluation = steps.add_parser("evaluate", help="print a network's errors; needs no torch")
    evaluation.add_argument("--model", type=Path, help="ONNX file; without it, the one that ships")
    evaluation.add_argument("--real", type=Path, help="folder of folders with real RGB-D frames")
    evaluation.add_argument("--rooms", type=int, default=60)
    arguments = vars(parser.parse_args())
    run: dict[str, Callable[..., None]] = {
        "render": run_render,
        "trace": run_trace,
        "train": run_train,
        "export": run_export,
        "evaluate": run_evaluate,
    }
    try:
        run[arguments.pop("step")](**arguments)
    except PacketMeshError as error:
        parser.exit(2, f"{error}\n")


def add_room_options(rendering: argparse.ArgumentParser) -> None:
    """Which rooms, and what furnishes them."""
    rendering.add_argument("--data", type=Path, required=True)
    rendering.add_argument("--split", choices=("train", "validation", "test"), default="train")
    rendering.add_argument("--first", type=int, default=0, help="first shard of ten rooms")
    rendering.add_argument("--last", type=int, default=10, help="one past the last shard")
    rendering.add_argument(
        "--furniture", type=Path, help="Sweet Home 3D's furniture: a folder or a .deb file"
    )
    rendering.add_argument("--cache", type=Path, help="folder for furniture made ready; kept between runs")


def add_train_options(training: argparse.ArgumentParser) -> None:
    """The options of ``train``; what they leave out is in ``TrainingConfig``."""
    training.add_argument("--data", type=Path, required=True)
    training.add_argument("--out", type=Path, required=True, help="folder; continued if it holds a last.pt")
    training.add_argument("--minutes", type=float, default=75.0, help="budget of all continued runs together")
    training.add_argument("--pause-minutes", type=float, default=math.inf, help="save and stop after these")
    training.add_argument("--learning-rate", type=float, default=4e-4)
    training.add_argument("--seed", type=int, default=0)
    training.add_argument(
        "--width", choices=("full", "half", "lite0"), help="of the encoder; default: what fits --initial"
    )
    training.add_argument(
        "--initial", choices=("random", "open-nsfw", "efficientnet-lite0"), default="random"
    )
    training.add_argument("--loss", choices=("scale-invariant", "berhu"), default="scale-invariant")
    training.add_argument("--precision", choices=("bf16", "fp32"), default="bf16")
    training.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")
    training.add_argument("--processes", type=int, default=2, help="on the CPU")


def run_render(
    data: Path, split: str, first: int, last: int, furniture: Path | None, cache: Path | None
) -> None:
    """Render shards and name each as it is done."""
    from lab.training.dataset import render_shards
    from lab.training.furniture import Catalogue

    catalogue = Catalogue.open(furniture, cache) if furniture else None
    for file in render_shards(data, split, first, last, catalogue):
        print(file, flush=True)


def run_trace(furniture: Path | None, cache: Path | None, **options: Any) -> None:
    """Path-trace shards and name each as it is done."""
    from lab.training.blend import render_traced
    from lab.training.furniture import Catalogue

    catalogue = Catalogue.open(furniture, cache) if furniture else None
    for file in render_traced(catalogue=catalogue, **options):
        print(file, flush=True)


def run_train(width: Width | None, initial: Initial, **options: object) -> None:
    """Train or continue training."""
    from lab.training.initial import WIDTHS
    from lab.training.train import TrainingConfig, train

    train(TrainingConfig(width=width or WIDTHS[initial], initial=initial, **options))  # type: ignore[arg-type]


def run_export(checkpoint: Path, data: Path, out: Path) -> None:
    """Export and say what the 8-bit file loses against the float one."""
    from lab.training.export import export

    print(export(checkpoint, data, out))


def run_evaluate(model: Path | None, real: Path | None, rooms: int) -> None:
    """Print the table line by line."""
    from lab.training.evaluate import evaluate

    for line in evaluate(model, real, rooms):
        print(line, flush=True)


if __name__ == "__main__":
    main()
