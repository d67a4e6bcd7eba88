"""``packetmesh deliver``: send a rig's images through a network and rebuild the surface from what arrives."""

from __future__ import annotations

import os
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.cli.options import Images, PresetName, Settings
from app.cli.text import print_json, say, say_progress
from packetmesh.progress import drain
from packetmesh.settings import config_named, key_of, settings, with_settings

if TYPE_CHECKING:
    from network_sim.config import NetworkConfig
    from pipeline.config import PipelineConfig
    from pipeline.delivery.moments import Moment


def deliver(
    images: Images,
    out: Path,
    preset: str = "office",
    coding: str = "exact",
    moments: int = 40,
    link_trace: Path | None = None,
    down: tuple[str, ...] = (),
    leave_out_seen: bool = False,
    order: Literal["own", "worth"] = "own",
    every_radio: bool = False,
    chain: PresetName = "packetmesh",
    set: Settings = (),
    json: bool = False,
) -> None:
    """Send a rig's images through a network and rebuild the scene from what has arrived by each moment.

    Args:
        images: Images that the nodes send. The camera of a recording is one node, which sends its keyframes,
            each from the time at which it was taken.
        out: Folder for the final result (the files of `reconstruct`), moments.csv and delivery.html.
        preset: The network: thesis-link, greenhouse, office, wifi-n, wifi-ax, wifi-ah, lora, ble, lte-m,
            nb-iot, or the config.json of a finished simulation.
        coding: How images are encoded: raw, raw-color-first, raw-rows, raw-tiles, png, jpeg, rvl, tiles,
            layered or exact.
        moments: Number of times at which the scene is rebuilt, after equal shares of the bytes.
        link_trace: A recorded link over which every node sends: columns (s, Mbit/s, round trip ms, loss
            share), a mahimahi trace, or the output of iperf3 --json.
        down: Names of nodes that have failed and send nothing, for example node_02.
        leave_out_seen: Leave out tiles that another camera shows. Every node first sends a coarse image; by
            these the sink tells each node its tiles. Needs the coding exact and two cameras, no recording.
        order: Order of the depth tiles: the coding's own, or by what they add to the surface: every node
            first sends a coarse image, by which the sink requests them. Needs the coding exact, and no
            recording.
        every_radio: Send the images by every radio, each in a network of its own, and print what each needs
            for the surface; `--preset` and `--link-trace` then have no effect, and only every_radio.json
            is written. It takes minutes; fewer `--moments` are quicker.
        chain: Settings of the reconstruction to start from.
        set: Settings of the network or the reconstruction, for example
            `--set nodes.retransmit=false loss.share=0.1 loss.burst_packets=8`.
        json: Print the moments as one JSON object.
    """
    named = images.source()
    before, network, config, of_network = settings_of(preset, chain, set)

    from app.cli.every_radio import every_radio as compare_radios
    from app.cli.reconstruct import imported_notes
    from app.cli.runs import iterate_imported
    from app.reports.hand_out_of import write_hand_out
    from packetmesh.files import writable_folder
    from pipeline.deliver import iterate_delivery
    from pipeline.delivery.sending import DeliverySpec
    from pipeline.folders.delivery import (
        delivery_metrics,
        left_out_sentences,
        ordered_sentences,
        summary,
        walk_sentences,
        write_delivery_folder,
    )
    from pipeline.folders.run import check_run_folder, clear_run_folder
    from pipeline.spec import Spec
    from pipeline.stages import RunCache, compute

    check_run_folder(out, named)
    source, imported = drain(iterate_imported(named, out), say_progress)
    if every_radio:
        if link_trace is not None:
            say("--link-trace changes nothing here: --every-radio takes every radio")
        if leave_out_seen:
            say("--leave-out-seen changes nothing here: --every-radio sends all tiles")
        if order != "own":
            say("--order changes nothing here: --every-radio sends the tiles in the coding's own order")
        compare_radios(Spec(source, chain, config), coding, moments, down, of_network, out, json)
        return
    if link_trace is not None:
        network = _with_link(network, link_trace, of_network)
    say_network(network, before, preset, of_network, {})
    chain_spec = Spec(source, chain, config)
    delivery_spec = DeliverySpec(chain_spec, network, coding, moments, down, leave_out_seen, order)
    cache = RunCache()
    drain(compute(delivery_spec.spec, "rig", cache), say_progress)
    steps = iterate_delivery(delivery_spec, min(2, os.cpu_count() or 1), cache)
    first = next(steps)  # an error here leaves no folder
    writable_folder(out)
    _say_moment(first)
    delivery = drain(steps, _say_moment)
    report = None if imported is None else asdict(imported)
    metrics = delivery_metrics(delivery) | ({} if report is None else {"import": report})
    clear_run_folder(out)
    page = write_hand_out(delivery, out)
    write_delivery_folder(delivery, metrics, preset, out)
    say(f"100%  {summary(delivery)}; see {page}")
    sending = delivery.sending
    for sentence in (*walk_sentences(sending), *left_out_sentences(sending), *ordered_sentences(sending)):
        say(sentence)
    for note in (*imported_notes(report), *delivery.sending.rig.notes):
        say(note)
    if json:
        print_json(metrics)


def settings_of(
    preset: str, chain: str, changes: tuple[str, ...]
) -> tuple[NetworkConfig, NetworkConfig, PipelineConfig, list[str]]:
    """Return the network before and after its changes, the chain's settings, and the network's changes.

    A change whose key belongs to a part of the chain's settings is for the chain, any other for the network.
    """
    from network_sim.presets import PRESETS as NETWORKS
    from pipeline.config import PRESETS

    network, config = config_named(preset, NETWORKS), config_named(chain, PRESETS)
    parts = {key.partition(".")[0] for key in settings(config)}
    of_chain = [change for change in changes if change.partition(".")[0] in parts]
    of_network = [change for change in changes if change not in of_chain]
    return network, with_settings(network, of_network), with_settings(config, of_chain), of_network


def _with_link(network: NetworkConfig, link_trace: Path, changes: list[str]) -> NetworkConfig:
    """Return the network with a recorded link for every node; print which given settings it replaces."""
    replayed = replace(network, mac=replace(network.mac, kind="replay", trace=str(link_trace)))
    for change in changes:
        key, value = key_of(change), change.partition("=")[2].strip()
        if key in ("mac.kind", "mac.trace") and settings(replayed)[key] != value:
            say(f"{change} changes nothing here: --link-trace sets {key}={settings(replayed)[key]}")
    return replayed


def say_network(
    network: NetworkConfig,
    before: NetworkConfig,
    preset: str,
    changes: list[str],
    replacing: dict[str, str],
) -> None:
    """Print which of the network's settings change nothing, and how recorded links were read.

    Args:
        network: the network, with the changes.
        before: the preset without them.
        preset: name of the preset, or of its file.
        changes: settings as ``key=value``.
        replacing: further settings that the command replaces, with the reason.
    """
    from app.cli.simulate import say_network_notes
    from network_sim.config import ANY_DISTANCE
    from pipeline.delivery.plan import replaced_settings

    replaced = replaced_settings(network) | replacing
    for key in dict.fromkeys(map(key_of, changes)):
        if key in replaced:
            say(f"{key} changes nothing here: {replaced[key]}")
    placed = network.nodes.places_m or network.mac.kind in ANY_DISTANCE
    if "nodes.layout" in map(key_of, changes) and not placed:
        say("nodes.layout changes nothing here if the rig has poses: the nodes stand where the poses are")
    others = [change for change in changes if key_of(change) not in replaced]
    say_network_notes(network, before, preset, others, placed=False)


def _say_moment(moment: Moment) -> None:
    line = f"{moment.t_s:8.3f} s, {moment.delivered_bytes:,} B"
    if moment.surface is None:
        say(f"{line}; no surface yet")
        return
    score = "" if moment.truth is None else f", F-score {moment.truth['f_score_5cm']:.3f}"
    say(f"{line}; {moment.surface.quality.no_hit_ray_share:.1%} of the rays are without a surface{score}")
