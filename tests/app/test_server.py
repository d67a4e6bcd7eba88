"""Addresses that cannot be used, what a session starts with, and what serving does not load."""

import socket
import subprocess
import sys

import pytest

from app.server import build_server, start_spec
from packetmesh.errors import InputError
from pipeline.config import PRESETS, PipelineConfig
from pipeline.sources import Demo, Recorded, RigFolder


def test_a_taken_port_is_one_sentence():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=f"Port {port} is taken .* --port {port + 1}"):
            build_server(port=port)


@pytest.mark.parametrize(
    ("host", "port", "sentence"),
    [
        ("no.such.host.invalid", 8080, "not an address of this machine"),
        ("192.0.2.1", 8080, "Cannot listen on 192.0.2.1"),
        ("127.0.0.1", 70000, "no port 70000"),
    ],
)
def test_an_address_that_cannot_be_used_is_one_sentence(host, port, sentence):
    with pytest.raises(InputError, match=sentence):
        build_server(host=host, port=port)


def test_a_folder_is_a_rig_a_bag_a_recording_and_a_name_a_demo(tmp_path):
    assert start_spec(str(tmp_path), PipelineConfig()).source == RigFolder(str(tmp_path))
    (tmp_path / "walk.bag").write_bytes(b"#ROSBAG V2.0\n")
    bag = str(tmp_path / "walk.bag")
    assert start_spec(bag, PipelineConfig()).source == Recorded(bag)
    assert start_spec("office", PRESETS["thesis"]).source == Demo("office")
    assert start_spec("office", PRESETS["thesis"]).preset == "thesis"
    walk = start_spec("living-room-walk", PipelineConfig()).source
    assert isinstance(walk, Recorded)
    assert walk.demo == "living-room-walk"


def test_the_serving_process_loads_nothing_heavy():
    heavy = (
        "{'onnxruntime', 'trimesh', 'open3d', 'numba', 'pipeline.surface.ball_pivoting', 'pipeline.depth'}"
    )
    script = f"import sys, app.server; print({heavy} & set(sys.modules))"
    text = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert text.stdout.strip() == "set()"
