"""``packetmesh plan``: where the next cameras of a rig stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.options import Images, PresetName, Settings
from app.cli.text import aligned, print_json, say, say_progress, wrong_use
from packetmesh.progress import drain, part

if TYPE_CHECKING:
    from pipeline.planning.calls import RigPlan
    from pipeline.reconstruct import Reconstruction

SinkPlace = Annotated[str | None, tyro.conf.arg(metavar="X,Y|best")]
HEADINGS = (
    *(
        "camera",
        "x m",
        "y m",
        "height m",
        "pan",
        "tilt",
        "on",
        "promise points (95 %)",
        "of it dark",
        "overlap",
    ),
    *("90 % after s", "99 % after s", "J", "battery days"),
)
REPLACED = {
    "radio.walls_m": "the walls are found in the surface",
    "radio.wall_db": "--walls names their material",
}
"""Settings of the network that a plan replaces, with the reason."""
DONE = 0.7
"""Share of the progress at which the reconstruction is finished."""


def plan(
    images: Images,
    out: Path | None = None,
    cameras: int = 1,
    sensor: str = "as-present",
    where: str = "walls,ceiling,furniture,tripods",
    preset: str = "office",
    coding: str = "exact",
    walls: str = "brick",
    dark_surface: bool = True,
    sink: SinkPlace = None,
    every_s: float = 600.0,
    budget_j: float | None = None,
    deadline_s: float | None = None,
    chain: PresetName = "packetmesh",
    set: Settings = (),
    json: bool = False,
) -> None:
    """Say where the next cameras stand best, what they add, and what their images cost by radio.

    Reconstructs the scene, judges up to 500 free places, and chooses the cameras that together measure most
    of what the present ones miss. Each must see enough of what a present one measures to be registered.

    Args:
        images: Images of the present cameras.
        out: Folder for plan.json, plan.html, and floor_plan.pdf and .svg, which are true to scale; without it
            the plan is only printed.
        cameras: Number of cameras to add, up to 20.
        sensor: Their depth camera: as-present, kinect-v1, kinect-v2, azure-kinect or realsense-d435.
        where: Where they may stand, separated by commas: walls, ceiling, furniture, tripods.
        preset: The network: a preset of `deliver`, or the config.json of a finished simulation.
        coding: How images are encoded; `deliver` lists the codings.
        walls: Material of the walls, which damp the radio: plaster, wood, brick or concrete.
        dark_surface: Let surface count that looks dark to a present sensor, such as a screen. A camera of the
            same kind may get no depth there; --no-dark-surface plans without it.
        sink: Place of the sink in metres, or "best": where its weakest link to a camera is strongest; without
            it, the network's, or behind the present cameras.
        every_s: Time between two images of a camera, for the days that a battery lasts.
        budget_j: Most energy of all new cameras together for one image of each.
        deadline_s: Latest time until 99 % of the bytes of each new camera have arrived.
        chain: Settings of the reconstruction to start from.
        set: Settings of the network or the reconstruction, for example
            `--set radio.tx_power_dbm=10 surface.max_points=20000`.
        json: Print the plan as one JSON object.
    """
    from app.cli.deliver import say_network, settings_of

    named = images.source()
    sink_m = None if sink is None else _place(sink)
    before, network, config, of_network = settings_of(preset, chain, set)

    from pipeline.planning.plan import PlanConfig
    from pipeline.planning.radio import PlanRadio

    places = tuple(filter(None, where.split(",")))
    wanted = PlanConfig(cameras, sensor, places, dark_surface)  # type: ignore[arg-type]
    radio = PlanRadio(network, coding, walls, sink_m, every_s, budget_j, deadline_s)

    from app.cli.reconstruct import imported_notes, say_places
    from app.cli.runs import iterate_imported
    from packetmesh.files import removed_if_empty, writable_folder
    from pipeline.folders.plan import (
        PAGE,
        PRINT,
        best_sentence,
        check_plan_folder,
        dark_sentence,
        fewer_sentence,
        level_sentence,
        plan_record,
        promise_sentence,
        settings_record,
        times_sentence,
    )
    from pipeline.planning.calls import iterate_plan
    from pipeline.reconstruct import iterate_reconstruction
    from pipeline.spec import Spec
    from pipeline.stages import RunCache, compute

    if out is not None:
        check_plan_folder(out, named)
    with TemporaryDirectory() as scratch, removed_if_empty(out or Path(scratch)):
        source, imported = drain(iterate_imported(named, out or Path(scratch)), say_progress)
        say_network(network, before, preset, of_network, REPLACED)
        spec, cache = Spec(source, chain, config), RunCache()
        drain(part(compute(spec, "rig", cache), "reconstruction", 0.0, DONE, detail=True), say_progress)
        if out is not None:
            writable_folder(out)
        steps = iterate_reconstruction(spec, cache)
        done = drain(part(steps, "reconstruction", 0.0, DONE, detail=True), say_progress)
        planned = drain(part(iterate_plan(done, wanted, radio), "plan", DONE, 1.0, detail=True), say_progress)
    report = None if imported is None else asdict(imported)
    notes = [*imported_notes(report), *done.rig.notes]
    notes += filter(None, [fewer_sentence(planned, cameras), level_sentence(planned), dark_sentence(planned)])
    record = plan_record(planned, spec.source.title, preset)
    if out is not None:
        _write(planned, done, record | settings_record(spec, planned), notes, out)
    if json:
        print_json(record)
    else:
        print(aligned([HEADINGS, *_rows(planned)]))
    for sentence in (promise_sentence(planned), best_sentence(planned), times_sentence(planned), *notes):
        say(sentence)
    if out is not None:
        say(f"See {out / PAGE}; to print at 100 %: {out / PRINT}")
    say_places(done.placement)


def _write(
    planned: RigPlan, done: Reconstruction, record: dict[str, Any], notes: Sequence[str], out: Path
) -> None:
    """Write the report, the floor plan and, last, the record, in place of those of an earlier plan."""
    from app.reports.plan import write_plan_report
    from packetmesh.files import write_json
    from pipeline.folders.plan import RECORD, clear_plan_folder
    from pipeline.stages import dressed

    clear_plan_folder(out)
    texture = dressed(done.rig, done.placement, done.after)
    write_plan_report(planned, texture, out, [*notes, *done.placement.sentences])
    write_json(out / RECORD, record)


def _place(text: str) -> tuple[float, float] | Literal["best"]:
    """Return x and y of --sink, or "best"; exit with 2 if the text is something else."""
    if text == "best":
        return "best"
    try:
        x_m, y_m = (float(number) for number in text.split(","))
    except ValueError:
        wrong_use(
            f"--sink takes best or a place such as 1.5,-0.4 (metres, without blanks), not '{text.strip()}'"
        )
    return x_m, y_m


def _rows(planned: RigPlan) -> list[tuple[str, ...]]:
    """Return position, aim, place, promise, overlap, times and energy of each camera as text."""
    from app.reports.plan import position_rows, sent_rows

    return [
        (*position, *sent[1:])
        for position, sent in zip(position_rows(planned), sent_rows(planned), strict=True)
    ]
