"""``packetmesh register``: one point cloud onto another."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.text import answers_table, print_json, say, wrong_use
from packetmesh.errors import InputError

if TYPE_CHECKING:
    from pipeline.pairs.register import Answer


def register(
    source: Annotated[Path, tyro.conf.Positional],
    target: Annotated[Path, tyro.conf.Positional],
    out: Path,
    method: str = "ceicp-a",
    metric: Literal["point", "plane"] | None = None,
    init: Path | None = None,
    truth: Path | None = None,
    voxel_m: float | None = None,
    gate_m: float | None = None,
    start: Literal["given", "global"] = "given",
    scale: bool = False,
    metres_per_unit: tuple[float, float] = (1.0, 1.0),
    json: bool = False,
) -> None:
    """Move one point cloud onto another, of the kinds that `packetmesh mesh` reads, in metres.

    Args:
        source: The cloud that moves.
        target: The cloud that stays.
        out: Folder for transform.txt, metrics.json, steps.csv, aligned.ply and config.json.
        method: A method or peer by name, or `all` to compare them; a wrong name lists them.
        metric: Residual of our methods; point to plane unless a scale is asked for.
        init: Start pose of the source in the target's frame, 4 x 4 numbers; the identity without it.
        truth: The true pose, where it is known, to measure errors by.
        voxel_m: Thin both clouds to one point per cube of this edge first.
        gate_m: Largest distance of a pair; without it, of a ladder of gates the one that the data bear out.
        start: `global` finds the start pose by matching features.
        scale: Estimate a scale as well (our methods, point metric).
        metres_per_unit: Of the coordinates of the source and of the target: `0.001 1` if the source is in
            millimetres.
        json: Print the metrics as one JSON object.
    """
    from packetmesh.files import writable_folder
    from pipeline.folders.pair import answer_metrics, chosen_pose, write_register_folder
    from pipeline.io.clouds import read_cloud
    from pipeline.io.poses import read_pose
    from pipeline.pairs.draws import run_draws, with_gate
    from pipeline.pairs.register import chosen_methods, config_for, prepared_pair, run_methods
    from pipeline.registration.methods import METHODS
    from pipeline.surface.mesh_cloud import in_metres

    try:
        methods = chosen_methods(method)
    except InputError as error:
        wrong_use(str(error))
    config = config_for(methods, metric=metric, gate_m=gate_m, start=start, with_scale=scale)
    T_init, T_true = (None if path is None else read_pose(path) for path in (init, truth))
    moving, fixed = (
        in_metres(read_cloud(path), unit)
        for path, unit in zip((source, target), metres_per_unit, strict=True)
    )
    pair = prepared_pair(moving, fixed, config, voxel_m, T_init, T_true)
    if gate_m is None:
        config = with_gate(pair, config)
        say(f"The gate that the data bear out is {config.gate_m:.3g} m")
    answers = []
    alone = len(methods) == 1 and methods[0] in METHODS
    for answer in run_draws(methods[0], pair, config) if alone else run_methods(methods, pair, config):
        answers.append(answer)
        say(f"{answer.method}: {answer.stop_reason}")
    chosen_pose(answers)  # raises without a pose, before a folder is made
    writable_folder(out)
    files = {"source": source, "target": target, "init": init, "truth": truth}
    command: dict[str, Any] = {name: None if path is None else str(path) for name, path in files.items()}
    command |= {"method": method, "voxel_m": voxel_m, "metres_per_unit": metres_per_unit}
    write_register_folder(out, answers, moving, config, command, truth is not None)
    metrics = answer_metrics(answers, truth is not None)
    if json:
        print_json(metrics)
    else:
        print(answers_table(metrics))
    if alone and not answers[0].agreed:
        say(_disagreement_warning(answers[0]))


def _disagreement_warning(answer: Answer) -> str:
    """Return a warning that random draws of the points disagree, with advice."""
    ends = f"end up to {100.0 * answer.spread_m:.1f} cm from this answer, not within 0.5 cm"
    if not math.isfinite(answer.spread_m):
        ends = "do not all find a pose"
    return (
        f"{answer.draws} draws of the points {ends}: it is no surer than that; try --init with a closer "
        "start pose, --start global or another --gate-m"
    )
