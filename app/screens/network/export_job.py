"""Jobs that export a delivery or the timeline of network runs."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.colors import NEUTRAL
from app.reports.captioned import png
from app.reports.delivery import delivery_animation, delivery_page
from app.reports.hand_out import HandOut
from app.reports.hand_out_of import hand_out_of
from app.reports.timeline_picture import timeline_picture
from app.screens.network.delivery_job import cloud_of, moment_of, reconstruction_of, sending_of
from app.screens.network.delivery_view import DeliveryView
from app.screens.network.job import network_job
from app.screens.network.lanes import lanes_of
from app.screens.network.packets import Frames
from app.screens.network.view import NetworkView
from network_sim.simulate import iterate_simulation
from network_sim.trace.files import write_trace
from network_sim.trace.log import NetworkTrace
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.deliver import Delivery
from pipeline.delivery.moments import Moment, Rebuilder
from pipeline.delivery.sending import frames_at_sink, received_at
from pipeline.io.clouds import write_cloud
from pipeline.io.meshes import write_mesh
from pipeline.kernels.geometry import apply
from pipeline.types import PointCloud

Content = Generator[Progress, None, bytes]


def page_job(store: Store, spec: Spec) -> Content:
    """Return the page that plays the delivery."""
    hand_out = yield from _hand_out(store, spec)
    yield Progress("writing the page", 0.9)
    return delivery_page(hand_out).encode()


def animation_job(store: Store, spec: Spec) -> Content:
    """Return the delivery as a GIF."""
    hand_out = yield from _hand_out(store, spec)
    yield Progress("drawing the moments", 0.9)
    return delivery_animation(hand_out)


def mesh_job(store: Store, spec: Spec, index: int, file: str) -> Content:
    """Return the surface of a moment's data, in the mesh format of the file's name.

    Raises:
        InputError: there is no surface yet.
    """
    sending = yield from sending_of(store, spec)
    moment = yield from moment_of(store, spec, Rebuilder(sending), index, 0)
    surface = moment.surface
    if surface is None or not len(surface.triangles):
        raise InputError(
            f"At {moment.t_s:.3g} s there is no surface yet; move the Network screen's clock to a later time"
        )
    return _written(file, lambda path: write_mesh(path, surface))


def cloud_job(store: Store, spec: Spec, index: int) -> Content:
    """Return all nodes' measured points that have arrived by a moment, world frame, as PLY.

    Raises:
        InputError: there are no points yet.
    """
    sending = yield from sending_of(store, spec)
    moment = yield from moment_of(store, spec, Rebuilder(sending), index, 0)
    received = received_at(sending, int(sending.times_ns[index]))
    places, colors = [], []
    for frame, got in zip(frames_at_sink(sending, received), received, strict=True):
        cloud = cloud_of(frame)
        places.append(apply(moment.T_world_camera.get(frame.name, frame.T_world_camera), cloud.points_m))
        grey = np.tile(np.array(NEUTRAL, np.uint8), (len(cloud), 1))
        colors.append(grey if cloud.colors is None or not got.rgb_known.any() else cloud.colors)
    whole = PointCloud(np.vstack(places), np.vstack(colors))
    if not len(whole):
        raise InputError(
            f"At {moment.t_s:.3g} s no point has arrived yet; move the Network screen's clock to a later time"
        )
    return _written("cloud.ply", lambda path: write_cloud(path, whole))


def timeline_job(store: Store, spec: Spec, labels: tuple[str, ...]) -> Content:
    """Return the whole timeline as PNG; the labels are those of compared runs."""
    seen = yield from network_job(store, spec)
    delivery = seen if isinstance(seen, DeliveryView) else None
    if isinstance(seen, DeliveryView):
        runs: tuple[NetworkView, ...] = (seen.run,)
        title = f"{spec.source.title}: frames on the air, and what has arrived"
    else:
        runs = tuple(replace(run, label=label) for run, label in zip(seen, labels, strict=True))
        title = f"Frames on the air: {', '.join(labels)}"
    start_ns, end_ns = min(run.start_ns for run in runs), max(run.end_ns for run in runs)
    lanes = lanes_of(delivery, runs, [Frames(run) for run in runs])
    return png(timeline_picture(title, lanes, start_ns, end_ns))


def trace_job(store: Store, spec: Spec, labels: tuple[str, ...]) -> Content:
    """Return a ZIP with trace.ndjson, trace.csv and trace.json; for two runs, in one folder each."""
    traces: dict[str, NetworkTrace] = {}
    if spec.sent is not None:
        traces[""] = (yield from sending_of(store, spec)).trace
    for row, config in enumerate(spec.networks):
        folder = f"run_{row + 1}/" if len(labels) > 1 else ""
        traces[folder] = yield from iterate_simulation(config)
    yield Progress("writing the trace", 0.9)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive, tempfile.TemporaryDirectory() as folder:
        for name, trace in traces.items():
            write_trace(trace, Path(folder))
            for path in sorted(Path(folder).iterdir()):
                archive.write(path, f"{name}{path.name}")
    return file.getvalue()


def _hand_out(store: Store, spec: Spec) -> Generator[Progress, None, HandOut]:
    sending = yield from sending_of(store, spec)
    rebuilder, count = Rebuilder(sending), len(sending.times_ns)
    moments: tuple[Moment, ...] = ()
    for index in range(count):
        moments += ((yield from moment_of(store, spec, rebuilder, index, index)),)
    lossless = yield from reconstruction_of(store, sending)
    return hand_out_of(Delivery(sending, moments, None, lossless))


def _written(name: str, write: Callable[[Path], Any]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        write(path)
        return path.read_bytes()
