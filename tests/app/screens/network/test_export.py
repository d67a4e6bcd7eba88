"""A delivery and a network's run to take along: what has arrived by a moment, the timeline, the trace."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace
from types import SimpleNamespace

import pytest
from PIL import Image

from app.compute.state import Sent, Spec
from app.screens.network import delivery_job as job
from app.screens.network.delivery_job import delivery_job, reconstruction_of, sending_of
from app.screens.network.export import delivery_offers, network_offers
from app.screens.network.export_job import (
    animation_job,
    cloud_job,
    mesh_job,
    page_job,
    timeline_job,
    trace_job,
)
from app.screens.network.job import network_job
from app.screens.network.labels import NETWORKS
from app.web.markup import Markdown
from network_sim.presets import PRESETS
from packetmesh.errors import InputError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.config import PipelineConfig
from pipeline.io.clouds import read_cloud
from pipeline.io.demos import SCENES
from pipeline.sources import ImagePair

CONFIG = with_settings(PipelineConfig(), ["surface.max_points=3000"])
NODE = SCENES / "box-on-table" / "node_00"
PAIR = ImagePair(str(NODE / "color.png"), str(NODE / "depth.png"), str(NODE / "intrinsics.json"))
SPEC = replace(Spec(PAIR, config=CONFIG), sent=Sent(PRESETS["office"], "raw", 3))
STREET = with_settings(PRESETS["street-grid"], ["street.vehicles=5", *NETWORKS["street-grid"].settings])


@pytest.fixture(scope="module")
def view(store):
    return drain(delivery_job(store, SPEC))


def test_a_walk_is_compared_with_the_surface_of_its_keyframes(view, store):
    """Its map, which is not sent, would make the lossless images look better than they are."""
    sending = drain(sending_of(store, SPEC))
    walked = replace(sending, rig=replace(sending.rig, walk=SimpleNamespace(notes=())))
    result = drain(reconstruction_of(store, walked))
    assert result.rig.walk is None
    assert result.after.quality.no_hit_ray_share == view.lossless.no_hit_share


def test_images_before_coding_are_reconstructed_once_for_all_networks(view, store):
    other = replace(SPEC, sent=Sent(with_settings(PRESETS["office"], ["run.seed=7"]), "raw", 2))
    sending = None  # nothing is computed from it
    assert drain(job._lossless(store, other, sending)) == view.lossless


def test_mesh_and_clouds_are_those_of_the_moment(view, store, tmp_path):
    points = []
    for index, moment in enumerate(view.moments):
        path = tmp_path / f"{index}.ply"
        path.write_bytes(drain(cloud_job(store, SPEC, index)))
        points.append(len(read_cloud(path)))
        if not moment.triangles:
            with pytest.raises(InputError, match="no surface yet"):
                drain(mesh_job(store, SPEC, index, "moment.glb"))
            continue
        glb = drain(mesh_job(store, SPEC, index, "moment.glb"))
        head = json.loads(glb[20 : 20 + int.from_bytes(glb[12:16], "little")])
        indices = head["meshes"][0]["primitives"][0]["indices"]
        assert head["accessors"][indices]["count"] == 3 * moment.triangles
    assert points[0] < points[1] <= points[2]


def test_page_and_moving_picture_play_the_moments_that_were_shown(view, store):
    page = drain(page_job(store, SPEC)).decode()
    assert "PacketMesh" in page.split("</title>")[0]
    record = json.loads(page.split('id="record">')[1].split("</script>")[0])
    assert [one["triangles"] for one in record["moments"]] == [one.triangles for one in view.moments]
    assert Image.open(io.BytesIO(drain(animation_job(store, SPEC)))).n_frames == len(view.moments)


def test_the_timeline_has_colours_of_frames_and_the_trace_every_event(view, store):
    picture = Image.open(io.BytesIO(drain(timeline_job(store, SPEC, ()))))
    assert picture.width == 1600
    assert len(picture.convert("RGB").getcolors(1 << 20)) > 50
    with zipfile.ZipFile(io.BytesIO(drain(trace_job(store, SPEC, ())))) as archive:
        assert set(archive.namelist()) == {"trace.ndjson", "trace.csv", "trace.json"}
        lines = archive.read("trace.ndjson").decode().splitlines()
        assert len(lines) == len(archive.read("trace.csv").decode().splitlines()) - 1 > 100
        assert json.loads(lines[0])["t_ns"] >= 0


def test_two_runs_have_a_folder_each(store):
    spec = replace(SPEC, sent=None, networks=(STREET, with_settings(STREET, ["run.seed=2"])))
    labels = ("one", "two")
    drain(network_job(store, spec))
    assert Image.open(io.BytesIO(drain(timeline_job(store, spec, labels)))).width == 1600
    with zipfile.ZipFile(io.BytesIO(drain(trace_job(store, spec, labels)))) as archive:
        assert {name.split("/")[0] for name in archive.namelist()} == {"run_1", "run_2"}


def test_what_is_offered_is_of_the_clocks_moment_and_says_what_commands_make(view):
    moment = view.moments[-1]
    offers = delivery_offers(view, moment.t_ns, "packetmesh deliver --out runs/delivery")
    mesh = next(file for file in offers.files if file.file == "moment.glb")
    assert mesh.arguments == (len(view.moments) - 1, "moment.glb")
    assert f"{moment.t_ns / 1e9:.3g} s" in mesh.label
    assert len(delivery_offers(view, -1, "").files) == 2  # before anything has arrived
    runs = network_offers(("a", "b"), "simulate x\nsimulate y")
    assert runs.command.count("--out") == 2
    assert "`trace.csv`" in Markdown("{}").format(runs.note)
    assert "`delivery.gif`" in Markdown("{}").format(offers.note)
    assert "no trace" in network_offers((), "").note
