"""``packetmesh register``: one point cloud onto another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from app.cli.text import answers_table, print_json, say, wrong_use
from packetmesh.errors import InputError

EXIT_CODES = {"sure": 0, "doubtful": 3, "none": 4}
"""Exit codes of the verdicts; the files are written in any case."""


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
    metres_per_unit: tuple[float, float] | None = None,
    columns: tuple[str, ...] = (),
    json: bool = False,
) -> None:
    """Register one point cloud with another, in any format that `packetmesh mesh` reads, in metres.

    The last line says whether the pose is sure, doubtful or none, and why; the exit code is 0, 3 or 4.

    Args:
        source: Cloud that moves.
        target: Cloud that stays.
        out: Folder for transform.txt, metrics.json, steps.csv, aligned.ply and config.json.
        method: A method by name, ours or a peer, or `all` to compare them; a wrong name lists them.
        metric: Residual of our methods; by default point to plane, with --scale point to point.
        init: Start pose of the source in the target's frame, a 4 x 4 matrix in a text file; without it, the
            identity.
        truth: True pose in the same format, if it is known, to measure errors.
        voxel_m: Thin both clouds to one point per cube of this edge first.
        gate_m: Largest distance of a pair; without it, the command tries several gates and chooses one from
            the data.
        start: `global` finds the start pose by matching features; `given` takes --init.
        scale: Estimate a scale as well (our methods, point metric).
        metres_per_unit: Metres per unit of the source and of the target: `0.001 1` if the source is in
            millimetres. Without it, the unit is the one in the column titles of a text file or in the
            coordinate system of a LAS file, or else the metre.
        columns: Columns of the text, .npy and .bin files, such as x,y,z,_,r,g,b with _ for a column that is
            not used: once for both clouds, or once for each, with `auto` for columns found in the file.
        json: Print the metrics as one JSON object.
    """
    from packetmesh.files import writable_folder
    from pipeline.folders.inputs import check_inputs_stay
    from pipeline.folders.pair import FILES, answer_metrics, chosen_answer, write_register_folder
    from pipeline.io.poses import read_pose
    from pipeline.pairs.clouds import read_pair
    from pipeline.pairs.found import find_place, judged, moved_away, settled_answer
    from pipeline.pairs.register import chosen_methods, config_for, prepared_pair, run_methods
    from pipeline.registration.methods import METHODS

    try:
        methods = chosen_methods(method)
    except InputError as error:
        wrong_use(str(error))
    check_inputs_stay([out / name for name in FILES], filter(None, (source, target, init, truth)))
    config = config_for(methods, metric=metric, gate_m=gate_m, start=start, with_scale=scale)
    T_init, T_true = (None if path is None else read_pose(path) for path in (init, truth))
    moving, fixed = read_pair(source, target, columns, metres_per_unit)
    pair = prepared_pair(moving, fixed, config, voxel_m, T_init, T_true, metres_per_unit)
    place = find_place(pair, config, gate_m)
    config = place.config
    if gate_m is None:
        say(f"Gate chosen from the data: {config.gate_m:.3g} m")
    alone = len(methods) == 1 and methods[0] in METHODS
    answers = []
    for answer in [settled_answer(methods[0], place)] if alone else run_methods(methods, place.pair, config):
        answers.append(answer if alone else judged(answer, place))
        say(f"{answer.method}: {answer.stop_reason}")
    chosen = chosen_answer(answers)  # raises without a pose, before a folder is made
    writable_folder(out)
    files = {"source": source, "target": target, "init": init, "truth": truth}
    command: dict[str, Any] = {name: None if path is None else str(path) for name, path in files.items()}
    command |= {"method": method, "voxel_m": voxel_m, "metres_per_unit": metres_per_unit or (1.0, 1.0)}
    if columns:
        command["columns"] = columns
    write_register_folder(out, answers, moving, config, command, truth is not None)
    metrics = answer_metrics(answers, truth is not None)
    if json:
        print_json(metrics)
    else:
        print(answers_table(metrics))
    assert chosen.T_target_source is not None
    assert chosen.verdict is not None
    if T_init is not None and (away := moved_away(pair, T_init, chosen.T_target_source)):
        say(away)
    say(f"The pose is {chosen.verdict.text}")
    if not chosen.verdict.sure:
        raise SystemExit(EXIT_CODES[chosen.verdict.word])
