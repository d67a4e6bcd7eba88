"""A small good file of every kind that is read: the reader, and a command that reads it."""

from __future__ import annotations

import io
import json
import struct
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import laspy
import numpy as np
import OpenEXR
import pye57
import trimesh
from PIL import Image

from network_sim.radio.link_file import read_link_trace
from packetmesh.files import write_json
from packetmesh.progress import drain
from packetmesh.settings import config_named, settings
from pipeline.calibration.shots import read_board
from pipeline.config import PRESETS
from pipeline.depth.inference import DepthNetwork
from pipeline.importing.bag import iterate_bag
from pipeline.importing.colmap import read_depth_map
from pipeline.importing.depth_units import depth_in
from pipeline.importing.kinds import kind_of
from pipeline.importing.numbered import read_trajectory_log
from pipeline.importing.stored import read_color_of
from pipeline.importing.tum import listed
from pipeline.io.camera_files import WRITERS
from pipeline.io.clouds import read_cloud
from pipeline.io.depth_correction import DepthCorrection, read_depth_correction, write_depth_correction
from pipeline.io.extrinsics import read_extrinsics, write_extrinsics
from pipeline.io.images import read_color, read_depth
from pipeline.io.intrinsics import read_intrinsics, write_intrinsics
from pipeline.io.meshes import read_mesh, write_mesh
from pipeline.io.poses import read_pose, write_pose
from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame, Rig, Surface
from tests.pipeline.depth.networks import channel
from tests.pipeline.importing.bags import write_bag
from tests.pipeline.importing.foxglove_files import write_foxglove
from tests.pipeline.strangers.containers import write_kinect, write_r3d, write_sens

RNG = np.random.default_rng(17)
COUNT = 60
POINTS = np.round(RNG.uniform(-2.0, 2.0, (COUNT, 3)), 3)
COLORS = RNG.integers(0, 256, (COUNT, 3), dtype=np.uint8)
TRIANGLES = np.arange(COUNT).reshape(-1, 3)
HEIGHT, WIDTH = 24, 32
RGB = RNG.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
MM = RNG.integers(900, 3000, (HEIGHT, WIDTH), dtype=np.uint16)
METRES = (MM / 1000.0).astype(np.float32)
CAMERA = CameraIntrinsics(
    np.array([[28.5, 0.0, 15.25], [0.0, 28.75, 11.5], [0.0, 0.0, 1.0]]),
    np.array([0.11, -0.21, 0.011, 0.012, 0.05]),
    WIDTH,
    HEIGHT,
)
TURN = trimesh.transformations.rotation_matrix(0.3, (0.2, 0.5, 0.8), (0.1, 0.2, 0.3))


@dataclass(frozen=True)
class Sample:
    """A good file and who reads it."""

    name: str
    data: bytes
    read: Callable[[Path], Any]
    command: str = ""
    """Its options, where FILE is it, DIR the folder above it, and OUT what would be written."""
    ends_anywhere: bool = False
    """Whether it may end after any line or row: nothing in it says how many there are."""


def make_beside(folder: Path) -> None:
    """The other files that the commands need."""
    (folder / "good.png").write_bytes(opencv(RGB, ".png"))
    (folder / "good_depth.png").write_bytes(opencv(MM, ".png"))
    (folder / "good.ply").write_bytes(ply("binary_little_endian"))
    write_intrinsics(folder / "good.json", CAMERA)
    write_extrinsics(folder / "good_extrinsics.json", np.eye(4))


def written(name: str, write: Callable[[Path], object]) -> bytes:
    """What a writer of files makes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()


def opencv(values: np.ndarray, suffix: str) -> bytes:
    return cv2.imencode(suffix, values)[1].tobytes()


def npy(values: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, values, allow_pickle=True)
    return stream.getvalue()


def npz(**arrays: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def tiff(values: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(values).save(stream, format="TIFF")
    return stream.getvalue()


def exr(**channels: np.ndarray) -> bytes:
    stream = io.BytesIO()
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    with OpenEXR.File(header, channels) as file:
        file.write(stream)
    return stream.getvalue()


def pfm(values: np.ndarray, order: str = "<") -> bytes:
    scale = -1.0 if order == "<" else 1.0
    return f"Pf\n{WIDTH} {HEIGHT}\n{scale}\n".encode() + values[::-1].astype(f"{order}f4").tobytes()


def ply(kind: str, count: object = COUNT, points: np.ndarray = POINTS) -> bytes:
    head = f"ply\nformat {kind} 1.0\nelement vertex {count}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    if kind == "ascii":
        return head.encode() + text(points).encode()
    return head.encode() + points.astype("<f4" if kind == "binary_little_endian" else ">f4").tobytes()


def pcd(kind: str, body: bytes, count: object = COUNT, size: object = 4) -> bytes:
    head = f"VERSION 0.7\nFIELDS x y z\nSIZE {size} 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\n"
    return f"{head}POINTS {count}\nDATA {kind}\n".encode() + body


def vtk(kind: str, body: bytes, count: object = COUNT) -> bytes:
    head = f"# vtk DataFile Version 3.0\nby hand\n{kind}\nDATASET POLYDATA\nPOINTS {count} float\n"
    return head.encode() + body


def text(rows: np.ndarray, between: str = " ") -> str:
    return "".join(between.join(f"{value:.6g}" for value in row) + "\n" for row in rows)


def las(path: Path) -> None:
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales = [0.001] * 3
    file = laspy.LasData(header)
    file.x, file.y, file.z = POINTS.T
    file.write(str(path))


def e57(path: Path) -> None:
    with pye57.E57(str(path), mode="w") as file:
        names = ("cartesianX", "cartesianY", "cartesianZ")
        file.write_scan_raw(dict(zip(names, POINTS.T.copy(), strict=True)))


def packed_pcd(path: Path) -> None:
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))
    o3d.io.write_point_cloud(str(path), cloud, compressed=True)


def bag(kind: str) -> bytes:
    """The one file of a small bag."""
    frame = RgbdFrame("node_00", RGB, DepthMap(METRES), CAMERA, np.eye(4))
    rig = Rig("rig", (frame,))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / ("a.bag" if kind == "ros1" else "a")
        write_bag(path, rig, kind, moments=1)
        suffix = {"ros1": "bag", "ros2": "db3", "mcap": "mcap"}[kind]
        return next(Path(folder).rglob(f"*.{suffix}")).read_bytes()


def foxglove(encoding: str) -> bytes:
    """A small MCAP file of Foxglove's schemas."""
    rig = Rig("rig", (RgbdFrame("node_00", RGB, DepthMap(METRES), CAMERA, np.eye(4)),))
    return written("a.mcap", lambda path: write_foxglove(path, rig, encoding, moments=1))


def container(write: Callable[[Path, Rig], Path]) -> bytes:
    """A small file with all images of a recording."""
    rig = Rig("rig", (RgbdFrame("node_00", RGB, DepthMap(METRES), CAMERA, np.eye(4)),))
    with tempfile.TemporaryDirectory() as folder:
        return write(Path(folder) / "a", rig).read_bytes()


def iperf3() -> bytes:
    """A test over TCP, as iperf 3.12 writes it."""
    times = {"start": 0, "end": 1.000129, "seconds": 1.000128984451294, "bytes": 2621440}
    rate = {"bits_per_second": 20968815.348857943, "retransmits": 0, "omitted": False, "sender": True}
    streams = [times | {"socket": 5, "rtt": 100} | rate]
    second = {"start": 1.000129, "end": 2.000124, "seconds": 0.999994993209839, "bytes": 2490368}
    start = {"version": "iperf 3.12", "test_start": {"protocol": "TCP", "num_streams": 1, "blksize": 131072}}
    intervals = [{"streams": streams, "sum": times | rate}, {"streams": [], "sum": second | rate}]
    return json.dumps({"start": start, "intervals": intervals, "end": {}}, indent=1).encode()


def links() -> str:
    return "".join(f"{0.5 * k:.1f} 1.5 20.0 0.01\n" for k in range(40))


MESH = "mesh FILE --out OUT/mesh.ply"
COLOR = "reconstruct --color FILE --depth DIR/good_depth.png --intrinsics DIR/good.json --out OUT"
DEPTH = "reconstruct --color DIR/good.png --depth FILE --intrinsics DIR/good.json --out OUT"
CAMERA_OF = "reconstruct --color DIR/good.png --depth DIR/good_depth.png --intrinsics FILE --out OUT"
POSE = "register DIR/good.ply DIR/good.ply --init FILE --out OUT"
EXTRINSICS = (
    "reconstruct --color DIR/good.png --depth DIR/good_depth.png --intrinsics DIR/good.json "
    "--depth-intrinsics DIR/good.json --extrinsics FILE --out OUT"
)
CORRECTION = (
    "reconstruct --color DIR/good.png --depth DIR/good_depth.png --intrinsics DIR/good.json "
    "--calibration DIR/calibration --out OUT"
)
BOARD = "calibrate DIR --out OUT"
CONFIG = "reconstruct --scene box-on-table --preset FILE --out OUT"
LINK = "deliver --scene box-on-table --link-trace FILE --out OUT"
IMPORT = "import FILE --out OUT"
NETWORK = "infer-depth DIR/good.png --model FILE --out OUT"


def _read_bag(path: Path) -> Any:
    return drain(iterate_bag(path, 1, None))


def _read_container(path: Path) -> Any:
    kind = kind_of(path)
    assert kind is not None
    sequence = kind.read(path, None)
    return depth_in(sequence.candidates[0], sequence), read_color_of(sequence.candidates[0].color)


def _read_config(path: Path) -> Any:
    return config_named(str(path), PRESETS)


def _read_network(path: Path) -> Any:
    return DepthNetwork(path, "midas-small").infer(RGB)


def _surface(path: Path) -> None:
    write_mesh(path, Surface(POINTS, TRIANGLES))


@cache
def samples() -> tuple[Sample, ...]:
    """One of every kind."""
    rows = POINTS.astype("<f4")
    sweep = np.hstack([POINTS, np.ones((COUNT, 1))]).astype("<f4").tobytes()
    clouds = {
        "ascii.ply": ply("ascii"),
        "little.ply": ply("binary_little_endian"),
        "big.ply": ply("binary_big_endian"),
        "ascii.pcd": pcd("ascii", text(POINTS).encode()),
        "binary.pcd": pcd("binary", rows.tobytes()),
        "packed.pcd": written("a.pcd", packed_pcd),
        "a.npz": npz(points=POINTS),
        "cloud.npy": npy(POINTS),
        "a.xyz": text(POINTS).encode(),
        "a.csv": ("x,y,z\n" + text(POINTS, ",")).encode(),
        "a.pts": f"{COUNT}\n{text(POINTS)}".encode(),
        "ascii.vtk": vtk("ASCII", text(POINTS).encode()),
        "binary.vtk": vtk("BINARY", POINTS.astype(">f4").tobytes()),
        "000001.bin": sweep,
        "LIDAR_TOP.pcd.bin": np.hstack([POINTS, np.ones((COUNT, 2))]).astype("<f4").tobytes(),
        "decimal.csv": ("X;Y;Z\n" + text(POINTS, ";").replace(".", ",")).encode(),
        "titled.txt": ("//X Y Z Intensity\n" + text(np.hstack([POINTS, POINTS[:, :1]]))).encode(),
        "a.obj": written("a.obj", _surface),
        "a.stl": written("a.stl", _surface),
        "a.glb": written("a.glb", _surface),
        "a.las": written("a.las", las),
        "a.laz": written("a.laz", las),
        "a.e57": written("a.e57", e57),
    }
    tables = ("a.xyz", "a.csv", "decimal.csv", "titled.txt")
    anywhere = (*tables, "000001.bin", "LIDAR_TOP.pcd.bin", "a.obj")
    found = [Sample(name, data, read_cloud, MESH, name in anywhere) for name, data in clouds.items()]
    for suffix in ("ply", "obj", "stl", "glb"):
        name = f"mesh.{suffix}"
        found.append(Sample(name, written(name, _surface), read_mesh, ends_anywhere=suffix == "obj"))
    found.append(Sample("ascii.stl", _ascii_stl(), read_mesh))
    images = {
        "color.png": opencv(RGB, ".png"),
        "color.jpg": opencv(RGB, ".jpg"),
        "color.pgm": opencv(RGB[..., 0], ".pgm"),
        "color.ppm": opencv(RGB, ".ppm"),
        "color.tif": tiff(RGB),
        "color.npy": npy(RGB),
    }
    found += [Sample(name, data, read_color, COLOR) for name, data in images.items()]
    depths = {
        "depth.png": opencv(MM, ".png"),
        "depth.pgm": opencv(MM, ".pgm"),
        "depth.tif": tiff(MM),
        "packed.tif": opencv(MM, ".tiff"),
        "depth.npy": npy(MM),
        "depth.pfm": pfm(METRES),
        "depth.exr": exr(Z=METRES),
    }
    found += [Sample(name, data, read_depth, DEPTH) for name, data in depths.items()]
    found += [
        Sample(f"of_{name}", write(CAMERA).encode(), read_intrinsics, CAMERA_OF)
        for name, write in WRITERS.items()
        if name not in ("open3d.json", "camchain.yaml")
    ]
    no_lens = CameraIntrinsics(CAMERA.matrix, np.zeros(5), WIDTH, HEIGHT)
    found += [
        Sample("open3d.json", WRITERS["open3d.json"](no_lens).encode(), read_intrinsics, CAMERA_OF),
        Sample("camchain.yaml", WRITERS["camchain.yaml"](no_lens).encode(), read_intrinsics, CAMERA_OF),
        Sample(
            "own.json", written("a", lambda path: write_intrinsics(path, CAMERA)), read_intrinsics, CAMERA_OF
        ),
        Sample("ros.json", _ros_json(), read_intrinsics, CAMERA_OF),
        Sample(
            "matrix.txt",
            text(CAMERA.matrix).encode(),
            lambda path: read_intrinsics(path, (WIDTH, HEIGHT)),
            CAMERA_OF,
        ),
        Sample("pose.txt", written("a", lambda path: write_pose(path, TURN)), read_pose, POSE),
        Sample(
            "extrinsics.json", written("a", lambda p: write_extrinsics(p, TURN)), read_extrinsics, EXTRINSICS
        ),
        Sample(
            "calibration/node_00/depth_correction.json",
            written("a", lambda path: write_depth_correction(path, DepthCorrection((WIDTH, HEIGHT), 0.01))),
            read_depth_correction,
            CORRECTION,
        ),
        Sample("board.json", _board(), read_board, BOARD),
        Sample("config.json", written("a", _config), _read_config, CONFIG),
        Sample("link.txt", links().encode(), read_link_trace, LINK, True),
        Sample("mahimahi.up", b"".join(b"%d\n" % (7 * k) for k in range(60)), read_link_trace, LINK, True),
        Sample("iperf3.json", iperf3(), read_link_trace, LINK),
        Sample("a.bag", bag("ros1"), _read_bag, IMPORT),
        Sample("a.db3", bag("ros2"), _read_bag, IMPORT),
        Sample("a.mcap", bag("mcap"), _read_bag, IMPORT),
        Sample("protobuf.mcap", foxglove("protobuf"), _read_bag, IMPORT),
        Sample("json.mcap", foxglove("json"), _read_bag, IMPORT),
        Sample("a.r3d", container(write_r3d), _read_container, IMPORT),
        Sample("a.sens", container(write_sens), _read_container, IMPORT),
        Sample("a.mkv", container(write_kinect), _read_container, IMPORT, True),
        Sample("map.bin", f"{WIDTH}&{HEIGHT}&1&".encode() + METRES.tobytes(), read_depth_map),
        Sample("rgb.txt", b"".join(b"%d.5 rgb/%d.png\n" % (k, k) for k in range(20)), listed, "", True),
        Sample("traj.log", _log(), read_trajectory_log, "", True),
        Sample("a.onnx", written("a", lambda p: channel(p, image=(1, 3, 32, 48))), _read_network, NETWORK),
    ]
    return tuple(found)


def data_of(name: str) -> bytes:
    """The sample of that name."""
    return next(sample.data for sample in samples() if sample.name == name)


def _ascii_stl() -> bytes:
    return trimesh.Trimesh(POINTS, TRIANGLES, process=False).export(file_type="stl_ascii").encode()


def _ros_json() -> bytes:
    values = {
        "width": WIDTH,
        "height": HEIGHT,
        "distortion_model": "plumb_bob",
        "D": CAMERA.distortion.tolist(),
        "K": CAMERA.matrix.ravel().tolist(),
    }
    return json.dumps(values).encode()


def _board() -> bytes:
    return json.dumps({"pattern": "circles", "columns": 11, "rows": 9, "spacing_mm": 35.0}).encode()


def _config(path: Path) -> None:
    write_json(path, {"settings": settings(PRESETS["thesis"])})


def _log() -> bytes:
    return "".join(f"{k} {k} {k + 1}\n{text(np.eye(4))}" for k in range(13)).encode()


def glb_of(document: dict[str, Any], body: bytes = b"") -> bytes:
    """A binary glTF file of any content."""
    told = json.dumps(document).encode()
    told += b" " * (-len(told) % 4)
    chunks = struct.pack("<I4s", len(told), b"JSON") + told + struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
