"""``python -m pipeline.depth.training render|train|export|evaluate``."""

from __future__ import annotations

import argparse
from pathlib import Path


def main() -> None:
    """Parse the command line and run one step of making a network."""
    parser = argparse.ArgumentParser(prog="python -m pipeline.depth.training", description=__doc__)
    steps = parser.add_subparsers(dest="step", required=True)
    render = steps.add_parser("render", help="render rooms into shards")
    render.add_argument("--data", type=Path, required=True)
    render.add_argument("--split", choices=("train", "validation", "test"), default="train")
    render.add_argument("--first", type=int, default=0, help="first shard of ten rooms")
    render.add_argument("--last", type=int, default=150, help="one past the last shard")
    training = steps.add_parser("train", help="train until a time budget is spent")
    training.add_argument("--data", type=Path, required=True)
    training.add_argument("--out", type=Path, required=True)
    training.add_argument("--minutes", type=float, default=75.0)
    training.add_argument("--learning-rate", type=float, default=4e-4)
    training.add_argument("--seed", type=int, default=0)
    export = steps.add_parser("export", help="write the ONNX file of a checkpoint")
    export.add_argument("--checkpoint", type=Path, required=True)
    export.add_argument("--data", type=Path, required=True)
    export.add_argument("--out", type=Path, required=True)
    evaluation = steps.add_parser("evaluate", help="print a network's errors; needs no torch")
    evaluation.add_argument("--model", type=Path, help="ONNX file; without it, the one that ships")
    evaluation.add_argument("--real", type=Path, help="folder of folders with real RGB-D frames")
    evaluation.add_argument("--rooms", type=int, default=60)
    arguments = vars(parser.parse_args())
    run = {"render": run_render, "train": run_train, "export": run_export, "evaluate": run_evaluate}
    run[arguments.pop("step")](**arguments)


def run_render(data: Path, split: str, first: int, last: int) -> None:
    """Render shards and name each as it is done."""
    from pipeline.depth.training.dataset import render_shards

    for file in render_shards(data, split, first, last):
        print(file, flush=True)


def run_train(**options: object) -> None:
    """Train or continue training."""
    from pipeline.depth.training.train import TrainingConfig, train

    train(TrainingConfig(**options))  # type: ignore[arg-type]


def run_export(checkpoint: Path, data: Path, out: Path) -> None:
    """Export and say what the 8-bit file loses against the float one."""
    from pipeline.depth.training.export import export

    print(export(checkpoint, data, out))


def run_evaluate(model: Path | None, real: Path | None, rooms: int) -> None:
    """Print the table line by line."""
    from pipeline.depth.training.evaluate import evaluate

    for line in evaluate(model, real, rooms):
        print(line, flush=True)


if __name__ == "__main__":
    main()
