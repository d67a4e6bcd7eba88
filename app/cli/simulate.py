"""``packetmesh simulate``: runs of the camera network, with metrics and the trace of the first run."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from app.cli.options import Settings
from app.cli.text import print_json, say, say_progress, wrong_use

if TYPE_CHECKING:
    from network_sim.config import NetworkConfig
    from network_sim.replicate import Estimate, Estimates
    from packetmesh.progress import Progress

Result = TypeVar("Result")


def simulate(
    preset: str = "thesis-link",
    out: Path | None = None,
    set: Settings = (),
    replications: int = 1,
    sweep: str | None = None,
    scheduler: str | None = None,
    describe: bool = False,
    json: bool = False,
) -> None:
    """Run the camera network: packets from the nodes' cameras to the sink, and what they cost.

    Args:
        preset: thesis-link, street-grid, greenhouse, office, or the config.json of a finished run.
        out: Folder for trace.ndjson, trace.csv (of the first run), metrics.json and config.json.
        set: Settings to change, for example `--set nodes.images=5 radio.shadowing_db=4`.
        replications: Runs with seeds that count up from run.seed; 95 % intervals need two or more.
        sweep: One setting and its values, for example `scheme.k=3,5,10,none`; every value is replicated.
        scheduler: Address of a Dask scheduler that does the runs; this machine's cores without it.
        describe: List every setting with its value, unit and meaning, and run nothing.
        json: Print the metrics as one JSON object.
    """
    from network_sim.presets import PRESETS
    from packetmesh.settings import config_named, with_settings

    config = with_settings(config_named(preset, PRESETS), set)
    if describe:
        _describe(config, json)
    elif sweep is not None:
        _sweep(config, preset, sweep, replications, scheduler, out, json)
    else:
        _run(config, preset, replications, scheduler, out, json)


def _describe(config: NetworkConfig, json: bool) -> None:
    from packetmesh.settings_help import describe

    rows = describe(config)
    if json:
        print_json({row.key: {"value": row.value, "unit": row.unit, "meaning": row.doc} for row in rows})
        return
    for row in rows:
        print(f"{row.key}={row.value}{f' {row.unit}' if row.unit else ''}\n    {row.doc}")


def _run(
    config: NetworkConfig, preset: str, count: int, scheduler: str | None, out: Path | None, json: bool
) -> None:
    from network_sim.metrics.metrics import metrics
    from network_sim.replicate import estimates_of, iterate_runs, replications
    from network_sim.simulate import iterate_simulation
    from network_sim.trace.files import write_trace
    from packetmesh.files import writable_folder, write_json
    from packetmesh.settings import settings

    first, *others = replications(config, count)
    if out is not None:
        writable_folder(out)
    _say_disconnected(config)
    trace = _run_with_progress(iterate_simulation(first))
    runs = [metrics(trace)]
    if others:
        runs += _run_with_progress(iterate_runs(others, scheduler))
    estimates = estimates_of(runs)
    if out is not None:
        write_trace(trace, out)
        write_json(out / "config.json", {"preset": preset, "settings": settings(config)})
        write_json(out / "metrics.json", _record(estimates))
    _show(estimates, json)


def _say_disconnected(config: NetworkConfig) -> None:
    from network_sim.fixed.collection import disconnected

    alone = disconnected(config) if config.scenario == "collection" else ()
    if alone:
        say(f"no path of links leads to the sink from {', '.join(alone)}; try a larger radio.range_m")


def _sweep(
    config: NetworkConfig,
    preset: str,
    sweep: str,
    count: int,
    scheduler: str | None,
    out: Path | None,
    json: bool,
) -> None:
    from network_sim.replicate import iterate_sweep
    from packetmesh.files import writable_folder, write_json
    from packetmesh.settings import settings

    key, equals, values = sweep.partition("=")
    if not equals or not values:
        wrong_use(f"--sweep {sweep} names no values; try for example --sweep scheme.k=3,5,10,none")
    if out is not None:
        writable_folder(out)
    cases = _run_with_progress(iterate_sweep(config, key, values.split(","), count, scheduler))
    record = {f"{key}={value}": _record(estimates) for value, estimates in cases.items()}
    if out is not None:
        write_json(out / "config.json", {"preset": preset, "sweep": sweep, "settings": settings(config)})
        write_json(out / "metrics.json", record)
    if json:
        print_json(record)
        return
    for value, estimates in cases.items():
        print(f"{key}={value}")
        _show(estimates, json=False)


def _run_with_progress(steps: Generator[Progress, None, Result]) -> Result:
    """Run a computation and return its result; print every tenth of its progress."""
    printed = 0
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            return stop.value
        if (tenths := int(10.0 * progress.fraction + 1e-9)) > printed:
            printed = tenths
            say_progress(progress)


def _record(estimates: Estimates) -> dict[str, Any]:
    return {
        name: {"mean": one.mean, "ci95": one.ci95, "unit": one.unit, "definition": one.definition}
        for name, one in estimates.items()
    }


def _show(estimates: Mapping[str, Estimate], json: bool) -> None:
    if json:
        print_json(_record(estimates))
        return
    for name, one in estimates.items():
        interval = "" if one.ci95 is None else f" ± {one.ci95:.3g}"
        print(f"{name:<34} {one.mean:.5g}{interval} {one.unit}")
