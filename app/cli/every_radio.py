"""``packetmesh deliver --every-radio``: one rig's images by every radio, as a table and as JSON."""

from __future__ import annotations

from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from app.cli.text import aligned, print_json, say, say_progress
from packetmesh.progress import drain

if TYPE_CHECKING:
    from network_sim.config import NetworkConfig
    from pipeline.delivery.radios import RadioReach
    from pipeline.delivery.sending import DeliverySpec
    from pipeline.spec import Spec
    from pipeline.types import Rig

RECORD = "every_radio.json"
HEADINGS = ("preset", "radio", "90 % after", "99 % after", "radio J", "all J", "bytes on the air")
NEVER = "does not reach"


class _Task(NamedTuple):
    preset: str
    spec: DeliverySpec
    rig: Rig
    lossless_f_score: float | None


def every_radio(
    spec: Spec, coding: str, moments: int, down: tuple[str, ...], changes: list[str], out: Path, json: bool
) -> None:
    """Send a rig's images by every radio, and print what each needs for the surface.

    Args:
        spec: the images, and the settings of their reconstruction.
        coding: name in ``pipeline.delivery.CODINGS``.
        moments: number of times at which the scene is rebuilt, for each radio.
        down: names of failed nodes.
        changes: settings of all networks, as ``key=value``.
        out: folder for ``RECORD``.
        json: whether to print JSON instead of the table.
    """
    from packetmesh.batch import run_batch
    from packetmesh.files import writable_folder, write_json
    from packetmesh.settings import with_settings
    from pipeline.delivery.radios import RADIOS, radio_network
    from pipeline.delivery.sending import DeliverySpec
    from pipeline.stages import RunCache, compute

    cache = RunCache()
    rig: Rig = drain(compute(spec, "rig", cache), say_progress).value
    networks = {preset: with_settings(radio_network(preset), changes) for preset in RADIOS}
    specs = {name: DeliverySpec(spec, network, coding, moments, down) for name, network in networks.items()}
    lossless = _lossless_f_score(spec, rig, cache)
    writable_folder(out)
    tasks = [_Task(preset, one, rig, lossless) for preset, one in specs.items()]
    found: dict[int, RadioReach] = {}
    for index, row in run_batch(_reach, tasks):
        found[index] = row
        say(f"{len(found) / len(tasks):4.0%}  {row.preset}")
    rows = [found[index] for index in range(len(tasks))]
    shared = next(iter(networks.values()))
    record = _record(rows, spec, coding, moments, lossless) | _shared(shared)
    write_json(out / RECORD, record)
    if json:
        print_json(record)
    else:
        print(aligned([HEADINGS, *map(_cells, rows)]))
    for sentence in _sentences(rows, lossless, shared):
        say(sentence)
    say(f"See {out / RECORD}")


def _reach(task: _Task) -> RadioReach:
    from pipeline.delivery.radios import reach

    return reach(*task)


def _lossless_f_score(spec: Spec, rig: Rig, cache: Any) -> float | None:
    """Return the F-score of the surface from the images before coding; None without a truth.

    Of a walk, only the keyframes are sent, and so only they count.
    """
    from pipeline.reconstruct import iterate_reconstruction
    from pipeline.sources import LoadedRig
    from pipeline.spec import Spec
    from pipeline.types import Rig

    if rig.truth is None:
        return None
    if rig.walk is not None:
        spec = Spec(LoadedRig(Rig(rig.name, rig.frames, truth=rig.truth)), spec.preset, spec.config)
    truth = drain(iterate_reconstruction(spec, cache), say_progress).truth_after
    return None if truth is None else truth["f_score_5cm"]


def _record(
    rows: list[RadioReach], spec: Spec, coding: str, moments: int, lossless: float | None
) -> dict[str, Any]:
    """Return all numbers; a time that is null was not reached."""
    from pipeline.delivery.radios import RADIOS

    return {
        "scene": spec.source.title,
        "coding": coding,
        "moments": moments,
        "quality": "bytes" if lossless is None else "f_score_5cm",
        "lossless_f_score_5cm": lossless,
        "radios": [
            {"radio": RADIOS[row.preset], "reaches": isfinite(row.seconds_to_99_s)} | asdict(row)
            for row in rows
        ],
    }


def _shared(network: NetworkConfig) -> dict[str, Any]:
    """Return what all networks share: where the sink is, and how long a run takes at most."""
    nodes = network.nodes
    return {"sink_spacing_m": None if nodes.places_m else nodes.spacing_m, "longest_s": network.run.horizon_s}


def _cells(row: RadioReach) -> tuple[str, ...]:
    """Return the cells of a radio's line: its preset and radio, times, energies and sent bytes."""
    from pipeline.delivery.radios import RADIOS

    times = (_time(row.seconds_to_90_s), _time(row.seconds_to_99_s))
    spent = (_digits(row.radio_j), _digits(row.energy_j), f"{row.sent_bytes:,}")
    return (row.preset, RADIOS[row.preset], *times, *spent)


def _time(seconds: float) -> str:
    if not isfinite(seconds):
        return NEVER
    return f"{_digits(seconds)} s" if seconds < 7200.0 else f"{_digits(seconds / 3600.0)} h"


def _digits(value: float) -> str:
    return f"{value:.3g}" if value < 1000.0 else f"{value:,.0f}"


def _sentences(rows: list[RadioReach], lossless: float | None, network: NetworkConfig) -> list[str]:
    """Return what the columns mean, and how good the surface is where a radio does not reach."""
    from pipeline.delivery.radios import WHOLE

    quality = "the F-score (5 cm) without losses"
    if lossless is None:
        quality = "the bytes, as the scene has no truth to compare a surface with"
    nodes, hours = network.nodes, network.run.horizon_s / 3600.0
    where = "" if nodes.places_m else f", which stands {nodes.spacing_m:g} m behind them"
    return [
        f"90 % and 99 % are those of {quality}; joules and bytes are those until 99 %, joules of all nodes "
        f"without the sink{where}. A run ends after {hours:.3g} h at the latest.",
        *(
            f"{row.preset} comes to {row.share:.1%}: {row.delivered_bytes:,} of {row.image_bytes:,} bytes "
            "arrived"
            for row in rows
            if row.share < WHOLE
        ),
    ]
