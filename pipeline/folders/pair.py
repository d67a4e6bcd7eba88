"""Output folder of the registration of two clouds: pose, metrics, steps and the moved cloud."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from packetmesh.errors import ReconstructionError
from packetmesh.files import atomic_path, write_json
from packetmesh.settings import settings
from pipeline.config import PipelineConfig, RegistrationConfig
from pipeline.io.clouds import write_cloud
from pipeline.io.poses import write_pose
from pipeline.pairs.register import DEFAULT_METHOD, Answer
from pipeline.types import PointCloud

CONFIG, STEPS, POSE, CLOUD, METRICS = (
    "config.json", "steps.csv", "transform.txt", "aligned.ply", "metrics.json",
)  # fmt: skip
FILES = (CONFIG, STEPS, POSE, CLOUD, METRICS)
_STEP_COLUMNS = (
    "index", "sigma_m", "gate_m", "objective", "rmse_m", "mean_distance_m", "effective_pairs", "entropy_nat",
    "rotation_step_rad", "translation_step_m",
)  # fmt: skip


def answer_metrics(answers: Iterable[Answer], with_truth: bool) -> dict[str, dict[str, Any]]:
    """Return the metrics by method, as stored in ``metrics.json``."""
    names = ["T_target_source", "iterations", "stop_reason", "rmse_m", "average_hausdorff_m", "elapsed_s"]
    if with_truth:
        names.append("point_error_m")
    return {
        answer.method: {name: getattr(answer, name) for name in names} | _draws(answer) | _verdict(answer)
        for answer in answers
    }


def _verdict(answer: Answer) -> dict[str, Any]:
    """Return the verdict on the pose with the evidence, if it was judged."""
    if answer.verdict is None or answer.evidence is None:
        return {}
    evidence = answer.evidence
    return {
        "verdict": answer.verdict.word,
        "verdict_reasons": list(answer.verdict.reasons),
        "start": answer.way,
        "overlap_share": evidence.overlap_share,
        "on_surface_share": evidence.on_share,
        "seen_through_share": evidence.through_share,
        "height_over_noise": evidence.height_ratio,
        "stiffness": evidence.stiffness,
    }


def _draws(answer: Answer) -> dict[str, Any]:
    """Return how far apart the random draws of points end, if there were several."""
    return {} if answer.draws == 1 else {"draws": answer.draws, "spread_m": answer.spread_m}


def chosen_answer(answers: Sequence[Answer]) -> Answer:
    """Return the answer of CEICP-A if it found a pose, else of the first method that did.

    Raises:
        ReconstructionError: no method determined the pose; the message says why.
    """
    good = [answer for answer in answers if not answer.failed]
    if not good:
        reason = answers[0].stop_reason.partition(": ")[2].rstrip(".")
        raise ReconstructionError(f"{answers[0].method} found no pose: {reason}")
    return next((answer for answer in good if answer.method == DEFAULT_METHOD), good[0])


def write_register_folder(
    folder: Path,
    answers: Sequence[Answer],
    source: PointCloud,
    config: RegistrationConfig,
    command: dict[str, Any],
    with_truth: bool,
) -> None:
    """Write config.json, steps.csv, transform.txt, aligned.ply and metrics.json, each whole or not at all.

    Args:
        folder: created if it is missing.
        answers: answers of all methods that ran.
        source: the source cloud as it was read; the pose of ``chosen_answer`` is applied to it.
        config: settings of the registration.
        command: arguments of the command line, stored in ``config.json`` with the settings.
        with_truth: whether ``metrics.json`` contains errors against a true pose.

    Raises:
        InputError: the folder cannot be written.
        ReconstructionError: there is no pose to write.
    """
    pose = chosen_answer(answers).T_target_source
    assert pose is not None
    write_json(
        folder / CONFIG,
        command | {"settings": settings(replace(PipelineConfig(), node_registration=config))},
    )
    _write_steps(folder / STEPS, answers)
    write_pose(folder / POSE, pose)
    write_cloud(folder / CLOUD, source.transformed(pose))
    write_json(folder / METRICS, answer_metrics(answers, with_truth))


def _write_steps(path: Path, answers: Iterable[Answer]) -> None:
    """Write one line per iteration; the pose after it is written row by row, separated by blanks."""
    with atomic_path(path) as sibling, sibling.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["method", "elapsed_s", "pairs", *_STEP_COLUMNS, "T_target_source"])
        for answer in answers:
            for step, elapsed_s in zip(answer.steps, answer.step_times_s, strict=True):
                values = [getattr(step, name) for name in _STEP_COLUMNS]
                pose = " ".join(format(value, ".17g") for value in step.T_target_source.ravel())
                table.writerow([answer.method, elapsed_s, len(step.pairs), *values, pose])
