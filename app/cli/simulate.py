"""``packetmesh simulate``: runs of the camera network, with metrics and the trace of the first run."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
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
    pcap: bool = False,
    netem: bool = False,
    describe: bool = False,
    json: bool = False,
) -> None:
    """Simulate the camera network: packets from the cameras to the sink, and the energy that they cost.

    Args:
        preset: thesis-link, street-grid, greenhouse, office, wifi-n, wifi-ax, wifi-ah, lora, ble, lte-m,
            nb-iot, or the config.json of a finished run.
        out: Folder for config.json, metrics.json and, without --sweep, the trace of the first run
            (trace.ndjson, trace.csv and trace.json).
        set: Settings to change, for example `--set nodes.images=5 radio.shadowing_db=4`.
        replications: Number of runs, with seeds that count up from run.seed; 95 % intervals need two or
            more.
        sweep: One setting and its values, for example `scheme.k=3,5,10,none`; every value gets all
            replications.
        scheduler: Address of a Dask scheduler that does the runs; without it, this machine's cores do.
        pcap: Also write trace.pcap: the frames of the first run, for Wireshark and tshark.
        netem: Also write link.sh: a shell script that gives a Linux device a node's link, by tc netem.
        describe: List every setting with its value, unit and meaning, and run nothing.
        json: Print the metrics as one JSON object.
    """
    from network_sim.presets import PRESETS
    from packetmesh.settings import config_named, with_settings

    before = config_named(preset, PRESETS)
    config = with_settings(before, set)
    if describe:
        _describe(config, json)
        return
    files = tuple(name for name, wanted in (("pcap", pcap), ("netem", netem)) if wanted)
    if files and (out is None or sweep is not None):
        where = (
            "--sweep keeps no trace" if out is not None else "there is no folder to write to; try --out DIR"
        )
        wrong_use(f"--{files[0]} writes a file, but {where}")
    kept = set if sweep is None else _without_swept(set, sweep)
    say_network_notes(config, before, preset, kept)
    if sweep is not None:
        _sweep(config, preset, sweep, replications, scheduler, out, json)
    else:
        _run(config, preset, replications, scheduler, out, files, json)


def say_network_notes(
    config: NetworkConfig, before: NetworkConfig, preset: str, changes: Sequence[str], placed: bool = True
) -> None:
    """Print which given settings change nothing, and how recorded links were read.

    Args:
        config: the network, with the changes.
        before: the preset or the config file without the changes.
        preset: name of the preset, or path of the file, whose settings count as given.
        changes: settings as ``key=value``.
        placed: whether the nodes' places are those of the config, so that links can be compared.

    Raises:
        InputError: a recorded link cannot be read.
    """
    from network_sim.advice.no_effect import without_effect
    from network_sim.config import NetworkConfig
    from network_sim.presets import PRESETS
    from network_sim.radio.link_file import link_notes
    from packetmesh.settings import differences, key_of, settings

    given = [key_of(change) for change in changes]
    for key in dict.fromkeys(given):
        if given.count(key) > 1:
            say(f"{key} is given {given.count(key)} times; the last value counts: {settings(config)[key]}")
    if preset not in PRESETS:
        given += [key_of(change) for change in differences(before, NetworkConfig())]
        before = NetworkConfig()
    for sentence in (*without_effect(config, given, before if placed else None), *link_notes(config)):
        say(sentence)


def _describe(config: NetworkConfig, json: bool) -> None:
    from packetmesh.settings_help import describe

    rows = describe(config)
    if json:
        print_json({row.key: {"value": row.value, "unit": row.unit, "meaning": row.doc} for row in rows})
        return
    for row in rows:
        print(f"{row.key}={row.value}{f' {row.unit}' if row.unit else ''}\n    {row.doc}")


def _run(
    config: NetworkConfig,
    preset: str,
    count: int,
    scheduler: str | None,
    out: Path | None,
    files: tuple[str, ...],
    json: bool,
) -> None:
    from network_sim.export.capture import check_capture, write_capture
    from network_sim.export.netem import check_netem_script, write_netem_script
    from network_sim.metrics.metrics import metrics
    from network_sim.replicate import estimates_of, iterate_runs, replications
    from network_sim.simulate import iterate_simulation
    from network_sim.trace.files import write_trace
    from packetmesh.files import writable_folder, write_json
    from packetmesh.settings import settings

    first, *others = replications(config, count)
    if "pcap" in files:
        check_capture(first)
    if "netem" in files:
        check_netem_script(first)
    if out is not None:
        writable_folder(out)
    _say_disconnected(config)
    trace = _run_with_progress(iterate_simulation(first))
    runs = [metrics(trace)]
    if others:
        runs += _run_with_progress(iterate_runs(others, scheduler))
    estimates = estimates_of(runs)
    if out is not None:
        if "netem" in files:
            write_netem_script(trace, out / "link.sh")
        if "pcap" in files:
            write_capture(trace, out / "trace.pcap")
        write_trace(trace, out)
        write_json(out / "config.json", {"preset": preset, "settings": settings(config)})
        write_json(out / "metrics.json", _record(estimates))
    _show(estimates, json)


def _say_disconnected(config: NetworkConfig) -> None:
    from network_sim.fixed.collection import disconnected

    alone = disconnected(config) if config.scenario == "collection" else ()
    if alone:
        say(f"No path of links leads from {', '.join(alone)} to the sink; try a larger radio.range_m")


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
        wrong_use(f"--sweep {sweep} has no values; try for example --sweep scheme.k=3,5,10,none")
    if out is not None:
        writable_folder(out)
    _say_idle_sweep(config, key, values.split(","))
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


def _without_swept(changes: Sequence[str], sweep: str) -> list[str]:
    """Print which given settings the sweep replaces, and return the others."""
    from packetmesh.settings import key_of

    swept = [change for change in changes if key_of(change) == key_of(sweep)]
    for change in swept:
        say(f"{change} changes nothing here: --sweep sets {key_of(sweep)}")
    return [change for change in changes if change not in swept]


def _say_idle_sweep(config: NetworkConfig, key: str, values: Sequence[str]) -> None:
    """Print why the swept setting has no effect, if none of its values changes anything."""
    from network_sim.advice.no_effect import without_effect
    from packetmesh.settings import with_settings

    first, *others = (with_settings(config, [f"{key}={value}"]) for value in values)
    sentences = [without_effect(other, [key], first) for other in others]
    if sentences and all(sentences):
        say(sentences[0][0])


def _run_with_progress(steps: Generator[Progress, None, Result]) -> Result:
    """Run a computation and return its result; print its progress at each tenth of the way."""
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
