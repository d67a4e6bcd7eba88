"""Addresses that cannot be used, what a session starts with, and what serving does not load."""

import socket
import subprocess
import sys
from types import SimpleNamespace

import pytest

from app.server import AppServer, build_server, own_address, start_spec
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


@pytest.mark.parametrize(
    ("host", "here", "elsewhere"),
    [
        ("127.0.0.1", "127.0.0.1", "127.0.0.1"),
        ("localhost", "localhost", "localhost"),
        ("192.0.2.7", "192.0.2.7", "192.0.2.7"),
        ("0.0.0.0", "127.0.0.1", "own AF_INET"),
        ("::1", "[::1]", "[::1]"),
        ("::", "[::1]", "own AF_INET6"),
        ("2001:db8::7", "[2001:db8::7]", "[2001:db8::7]"),
    ],
)
def test_links_name_an_address_that_a_browser_can_open(monkeypatch, host, here, elsewhere):
    monkeypatch.setattr("app.server.own_address", lambda family: f"own {family.name}")
    listening = SimpleNamespace(get_host=lambda: host, get_port=lambda: 8080)
    app = AppServer(listening, None, None, None, crowd=None)
    assert (app.link, app.class_link) == (f"http://{here}:8080", f"http://{elsewhere}:8080")


@pytest.mark.parametrize("family", [socket.AF_INET, socket.AF_INET6])
def test_its_own_address_is_one_of_the_family(family):
    address = own_address(family)
    assert socket.inet_pton(family, address) != bytes(len(socket.inet_pton(family, address)))


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
