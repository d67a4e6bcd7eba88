"""Files that the Network screen offers for download, and the command that makes them."""

from __future__ import annotations

import shlex

from app.compute.state import Sent, Spec
from app.screens.network.delivery_view import DeliveryView
from app.web.markup import Markdown
from app.window.panel import Offer, Offers
from network_sim.presets import PRESETS
from packetmesh.settings import differences
from pipeline.config import PRESETS as CHAINS
from pipeline.config import PipelineConfig

JOB = "network.export_job"


def delivery_offers(view: DeliveryView, now_ns: int, command: str) -> Offers:
    """Return offers of a complete delivery, and of the data at the clock's moment."""
    files = [
        Offer("Page", "delivery.html", f"{JOB}:page_job"),
        Offer("GIF", "delivery.gif", f"{JOB}:animation_job"),
    ]
    moment = view.moment_at(now_ns)
    at = "its first moment"
    if moment is not None:
        index, at = view.times_ns.index(moment.t_ns), f"{moment.t_ns / 1e9:.3g} s"
        files += [
            Offer(f"Mesh at {at}", "moment.glb", f"{JOB}:mesh_job", (index, "moment.glb")),
            Offer(f"Clouds at {at}", "moment.ply", f"{JOB}:cloud_job", (index,)),
        ]
    hint = f"""An offline page and an animation that play the delivery; mesh and measured points of the data
that have arrived by the time on the Network screen's clock ({at})."""
    note = Markdown(
        "The command writes the page and the GIF as `delivery.html` and `delivery.gif`, and the final mesh."
    )
    return Offers("Delivery", hint, tuple(files), command, note)


def network_offers(labels: tuple[str, ...], commands: str) -> Offers:
    """Return offers of the timeline and the trace of street runs; of a delivery without labels and commands.

    Args:
        labels: labels of the runs.
        commands: command lines of the runs, one in each line.
    """
    files = (
        Offer("Timeline, PNG", "timeline.png", f"{JOB}:timeline_job", (labels,)),
        Offer("Trace, ZIP", "trace.zip", f"{JOB}:trace_job", (labels,)),
    )
    hint = "The whole timeline of the Network screen; every event of the network as NDJSON and CSV."
    if not commands:
        return Offers("Network", hint, files, note=Markdown("The command of the delivery writes no trace."))
    lines = [f"{line} --out runs/network-{row + 1}" for row, line in enumerate(commands.splitlines())]
    note = Markdown(
        "The command writes the trace as `trace.ndjson` and `trace.csv`; no command draws the timeline."
    )
    return Offers("Network", hint, files, "\n".join(lines), note)


def deliver_command(spec: Spec, preset: str, sent: Sent) -> str:
    """Return the command line that delivers the same rig in the same way."""
    words = ["packetmesh", "deliver", *spec.source.arguments(), "--preset", preset, "--coding", sent.coding]
    words += ["--moments", str(sent.moments)]
    if sent.leave_out_seen:
        words.append("--leave-out-seen")
    if sent.order != "own":
        words += ["--order", sent.order]
    if sent.down:
        words += ["--down", *sent.down]
    if spec.preset != "packetmesh":
        words += ["--chain", spec.preset]
    chain = CHAINS.get(spec.preset, PipelineConfig())
    if changed := differences(sent.network, PRESETS[preset]) + differences(spec.config, chain):
        words += ["--set", *changed]
    return shlex.join([*words, "--out", "runs/delivery"])
