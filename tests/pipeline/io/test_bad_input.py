"""Every bad file gets one sentence that names it and says what to try."""

import json
import zlib

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.clouds import read_cloud, write_cloud
from pipeline.io.images import read_color, read_depth, write_depth_mm
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.meshes import read_mesh, write_mesh
from pipeline.io.poses import read_pose
from pipeline.io.rigs import load_rig, save_rig
from pipeline.types import MAX_NODES, CameraIntrinsics, DepthMap, PointCloud, RgbdFrame, Rig, Surface

CAMERA = {"width": 16, "height": 12, "fx": 14.0, "fy": 14.0, "cx": 7.5, "cy": 5.5}


def png(image: np.ndarray) -> bytes:
    return cv2.imencode(".png", image)[1].tobytes()


def png_of_size(width_px: int, height_px: int) -> bytes:
    """A real PNG whose header claims another size."""
    data = bytearray(png(np.zeros((4, 4), np.uint8)))
    data[16:24] = width_px.to_bytes(4, "big") + height_px.to_bytes(4, "big")
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    return bytes(data)


def ply(header: str, body: bytes = b"") -> bytes:
    return f"ply\nformat binary_little_endian 1.0\n{header}end_header\n".encode() + body


NOISE = np.random.default_rng(0).integers(1, 2000, (60, 80)).astype(np.uint16)
JPEG = cv2.imencode(".jpg", np.zeros((40, 40, 3), np.uint8))[1].tobytes()
XYZ = "property float x\nproperty float y\nproperty float z\n"
K9 = [14, 0, 7.5, 0, 14, 5.5, 0, 0, 1]
EYE = np.eye(4)
TRIANGLE = Surface(np.eye(3), np.array([[0, 1, 2]]))


def camera_json(**changes) -> bytes:
    return json.dumps(CAMERA | changes).encode()


def pose(T: np.ndarray) -> bytes:
    return "\n".join(" ".join(map(str, row)) for row in T.tolist()).encode()


BAD_FILES = {
    "colour: missing": (read_color, None, "does not exist"),
    "colour: empty": (read_color, b"", "is empty"),
    "colour: text": (read_color, b"hello" * 20, "neither a PNG nor a JPEG"),
    "colour: truncated PNG": (read_color, png(NOISE)[:3000], "truncated or damaged"),
    "colour: only a signature": (read_color, png(NOISE)[:10], "truncated or damaged"),
    "colour: damaged PNG": (read_color, png(NOISE)[:3000] + b"x" + png(NOISE)[3001:], "truncated or damaged"),
    "colour: chunk of 200 MB": (
        read_color,
        png(NOISE)[:33] + b"\x0c" + png(NOISE)[34:],
        "truncated or damaged",
    ),
    "colour: truncated PGM": (read_color, b"P5 8 8 255\n" + bytes(63), "truncated or damaged"),
    "colour: PGM without a size": (read_color, b"P5" + b" " * 100_000 + b"x", "truncated or damaged"),
    "colour: a PGM too large": (read_color, b"P5 99999 99999 255\n" + bytes(9), "truncated or damaged"),
    "colour: truncated JPEG": (read_color, JPEG[:-40], "truncated or damaged"),
    "colour: bomb": (read_color, png_of_size(60000, 60000), "more than the 25 million"),
    "depth: missing": (read_depth, None, "does not exist"),
    "depth: truncated": (read_depth, png(NOISE)[:3000], "truncated or damaged"),
    "depth: zero": (read_depth, png(np.zeros((4, 4), np.uint16)), "no depth anywhere"),
    "depth: 8 bit": (read_depth, png(np.ones((4, 4), np.uint8)), "1 channel.* of 8 bits"),
    "depth: colours": (read_depth, png(np.ones((4, 4, 3), np.uint8)), "3 channel.* of 8 bits"),
    "depth: a JPEG": (read_depth, JPEG, "of 8 bits"),
    "depth: too near": (
        read_depth,
        png(np.full((4, 4), 2, np.uint16)),
        "0.002 m at 1000 units in a metre; try .* 1,",
    ),
    "depth: scale 1": (
        lambda path: read_depth(path, 1.0),
        png(np.full((4, 4), 2000, np.uint16)),
        "2e.03 m at 1 units in a metre; try --depth-scale 1000, which makes it 2 m",
    ),
    "depth: scale of TUM": (
        lambda path: read_depth(path, 1.0),
        png(np.full((4, 4), 10000, np.uint16)),
        "try --depth-scale 5000, which makes it 2 m",
    ),
    "depth: scale 0": (lambda path: read_depth(path, 0.0), png(NOISE), "depth scale .* is 0.0; try 1000"),
    "depth: scale NaN": (lambda path: read_depth(path, float("nan")), png(NOISE), "is nan; try 1000"),
    "intrinsics: missing": (read_intrinsics, None, "does not exist"),
    "intrinsics: binary": (read_intrinsics, b"\xff\xfe\x80" * 9, "not a text file"),
    "intrinsics: half JSON": (read_intrinsics, camera_json()[:30], "not valid JSON"),
    "intrinsics: nested JSON": (read_intrinsics, b'{"a":' * 100_000, "not valid JSON"),
    "intrinsics: other keys": (read_intrinsics, b'{"focal": 3}', "no known format"),
    "intrinsics: text": (read_intrinsics, b"hello world", "no known format"),
    "intrinsics: a focal length of no lens": (
        read_intrinsics,
        camera_json(fx=1e300),
        "a focal length of 1e\\+300 px for .* px, which no lens has",
    ),
    "intrinsics: without fy": (read_intrinsics, b'{"fx": 3, "width": 4}', "no known format"),
    "intrinsics: without size": (read_intrinsics, json.dumps({"K": K9}).encode(), "no known format"),
    "intrinsics: eight numbers": (read_intrinsics, json.dumps({"K": K9[1:]}).encode(), "no known format"),
    "intrinsics: words": (read_intrinsics, camera_json(fx="wide"), "no known format"),
    "intrinsics: negative": (read_intrinsics, camera_json(fx=-14.0), "focal lengths -14 and 14"),
    "intrinsics: zero": (read_intrinsics, camera_json(fy=0.0), "focal lengths 14 and 0"),
    "intrinsics: NaN": (read_intrinsics, camera_json(cx=float("nan")), "not finite"),
    "intrinsics: infinite size": (read_intrinsics, camera_json(width=float("inf")), "no known format"),
    "intrinsics: no width": (read_intrinsics, camera_json(width=-16), "image size of -16 x 12"),
    "intrinsics: wrong centre": (
        read_intrinsics,
        camera_json(cx=320.0),
        "principal point .320, 5.5. outside",
    ),
    "intrinsics: row-major": (
        read_intrinsics,
        json.dumps({"width": 16, "height": 12, "intrinsic_matrix": K9}).encode(),
        "skew or in the wrong order",
    ),
    "intrinsics: another lens": (
        read_intrinsics,
        json.dumps({"width": 16, "height": 12, "K": K9, "distortion_model": "omnidirectional"}).encode(),
        "distortion model omnidirectional",
    ),
    "intrinsics: seven coefficients": (
        read_intrinsics,
        json.dumps({"width": 16, "height": 12, "K": K9, "D": [0.1] * 7}).encode(),
        "distortion model of 7 coefficients",
    ),
    "pose: three columns": (read_pose, pose(EYE[:, :3]), "4 x 4 numbers"),
    "pose: words": (read_pose, b"a b c d\n" * 4, "4 x 4 numbers"),
    "pose: ragged": (read_pose, pose(EYE) + b" 7", "4 x 4 numbers"),
    "pose: NaN": (read_pose, pose(EYE * np.nan), "4 x 4 numbers"),
    "pose: scaled": (read_pose, pose(np.diag([2.0, 2, 2, 1])), "not a rigid"),
    "pose: mirrored": (read_pose, pose(np.diag([1.0, 1, -1, 1])), "not a rigid"),
    "pose: transposed": (read_pose, pose(EYE + 3.0 * np.eye(4)[[3]].T @ np.eye(4)[[0]]), "not a rigid"),
    "cloud: missing": (read_cloud, None, "does not exist"),
    "cloud: text": (read_cloud, b"hello", "not a PLY"),
    "cloud: header only": (read_cloud, b"ply\nformat ascii 1.0\n", "not a PLY"),
    "cloud: truncated": (read_cloud, ply(f"element vertex 9\n{XYZ}", bytes(60)), "after 5 of its 9 points"),
    "cloud: huge": (read_cloud, ply(f"element vertex 999999999\n{XYZ}"), "more than the 20 million"),
    "cloud: no x": (read_cloud, ply("element vertex 1\nproperty float y\n", bytes(4)), "no x, y, z"),
    "cloud: no points": (read_cloud, ply(f"element vertex 0\n{XYZ}"), "no point"),
    "cloud: all NaN": (
        read_cloud,
        ply(f"element vertex 1\n{XYZ}", np.full(3, np.nan, "<f4").tobytes()),
        "no point with finite",
    ),
    "cloud: faces first": (
        read_cloud,
        ply("element face 1\nproperty list uchar int v\n"),
        "unusual PLY header",
    ),
    "cloud: unknown type": (read_cloud, ply("element vertex 1\nproperty quad x\n"), "unusual PLY header"),
    "cloud: short lines": (
        read_cloud,
        f"ply\nformat ascii 1.0\nelement vertex 2\n{XYZ}end_header\n1 2 3\n4 5\n".encode(),
        "not 3 numbers",
    ),
    "cloud: missing lines": (
        read_cloud,
        f"ply\nformat ascii 1.0\nelement vertex 2\n{XYZ}end_header\n1 2 3\n".encode(),
        "after 1 of its 2 points",
    ),
    "mesh: missing": (lambda path: read_mesh(f"{path}.ply"), b"x", "does not exist"),
    "mesh: unknown format": (lambda path: read_mesh(f"{path}.off"), b"x", "no name for a mesh"),
    "cloud to .xyz": (
        lambda path: write_cloud(f"{path}.xyz", PointCloud(np.zeros((1, 3)))),
        b"x",
        "ends in .ply",
    ),
    "mesh to .off": (lambda path: write_mesh(f"{path}.off", TRIANGLE), b"x", "ends in"),
    "mesh of nothing": (
        lambda path: write_mesh(f"{path}.ply", Surface(EYE[:3, :3], np.empty((0, 3), int))),
        b"x",
        "no triangle",
    ),
    "depth beyond 16 bit": (
        lambda path: write_depth_mm(path, DepthMap(np.full((2, 2), 70.0, np.float32))),
        b"x",
        "cannot hold depths",
    ),
    "negative depth": (
        lambda path: write_depth_mm(path, DepthMap(np.full((2, 2), -1.0, np.float32))),
        b"x",
        "cannot hold depths",
    ),
}


def assert_one_sentence(error: InputError, name: str):
    text = str(error)
    assert name in text
    assert "\n" not in text
    assert ". " not in text
    assert not text.endswith(".")
    assert any(word in text for word in ("; try ", "; check "))


@pytest.mark.parametrize("case", BAD_FILES)
def test_a_bad_file_gets_its_sentence(tmp_path, case):
    use, content, says = BAD_FILES[case]
    path = tmp_path / "some_file"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=says) as error:
        use(path)
    assert_one_sentence(error.value, "some_file")
    assert [p.name for p in tmp_path.iterdir()] == ([] if content is None else ["some_file"])


@pytest.mark.parametrize("suffix", [".ply", ".glb", ".obj", ".stl"])
@pytest.mark.parametrize("damage", ["truncated", "text", "noise"])
def test_a_damaged_mesh_gets_its_sentence(tmp_path, suffix, damage):
    path = tmp_path / f"mesh{suffix}"
    write_mesh(path, Surface(np.random.default_rng(0).normal(size=(99, 3)), np.arange(99).reshape(-1, 3)))
    data = path.read_bytes()
    noise = np.random.default_rng(0).bytes(500)
    path.write_bytes({"truncated": data[: len(data) // 3], "text": b"hello\n", "noise": noise}[damage])
    with pytest.raises(InputError, match=r"truncated or damaged|no triangle with finite") as error:
        read_mesh(path)
    assert_one_sentence(error.value, f"mesh{suffix}")


@pytest.mark.parametrize(
    ("read", "limit"),
    [
        (read_color, "pipeline.io.images.MAX_IMAGE_BYTES"),
        (read_intrinsics, "packetmesh.files.MAX_TEXT_BYTES"),
        (read_cloud, "pipeline.io.clouds.MAX_GEOMETRY_BYTES"),
    ],
)
def test_too_large_a_file_is_not_read(tmp_path, monkeypatch, read, limit):
    monkeypatch.setattr(limit, 100)
    (tmp_path / "upload").write_bytes(bytes(101))
    with pytest.raises(InputError, match=r"larger than the 0\.0001 MB") as error:
        read(tmp_path / "upload")
    assert_one_sentence(error.value, "upload")


@pytest.fixture
def rig_folder(tmp_path):
    depth = DepthMap(np.ones((12, 16), np.float32))
    frame = RgbdFrame(
        "node", np.zeros((12, 16, 3), np.uint8), depth, CameraIntrinsics.pinhole(14, 14, 7, 5, 16, 12), EYE
    )
    save_rig(tmp_path / "rig", Rig("rig", (frame, frame)))
    return tmp_path / "rig"


def test_sizes_that_do_not_match_are_named(rig_folder):
    write_depth_mm(rig_folder / "node_01" / "depth.png", DepthMap(np.ones((10, 16), np.float32)))
    with pytest.raises(
        InputError, match=r"depth.png has 16 x 10 pixels but .*color.png has 16 x 12"
    ) as error:
        load_rig(rig_folder)
    assert_one_sentence(error.value, "node_01")


def test_intrinsics_of_another_size_are_named(rig_folder):
    (rig_folder / "node_00" / "intrinsics.json").write_bytes(camera_json(width=32))
    with pytest.raises(InputError, match=r"intrinsics.json is for 32 x 12 .*color.png has 16 x 12") as error:
        load_rig(rig_folder)
    assert_one_sentence(error.value, "node_00")


def test_a_missing_file_of_a_node_is_named(rig_folder):
    (rig_folder / "node_01" / "depth.png").unlink()
    with pytest.raises(InputError, match="does not exist") as error:
        load_rig(rig_folder)
    assert_one_sentence(error.value, str(rig_folder / "node_01" / "depth.png"))


def test_a_rig_without_folder_or_nodes_or_with_too_many(rig_folder):
    with pytest.raises(InputError, match="elsewhere does not exist"):
        load_rig(rig_folder / "elsewhere")
    (rig_folder / "empty").mkdir()
    with pytest.raises(InputError, match="holds no node; try empty/node_00/"):
        load_rig(rig_folder / "empty")
    for index in range(2, MAX_NODES + 1):
        (rig_folder / f"node_{index:02d}").mkdir()
    with pytest.raises(InputError, match="holds 201 nodes; try to move some away, so that at most 200"):
        load_rig(rig_folder)


def test_a_smaller_rig_does_not_mix_with_a_larger_one(rig_folder):
    rig = load_rig(rig_folder)
    with pytest.raises(InputError, match="already holds node_01 of another rig; try an empty folder"):
        save_rig(rig_folder, Rig("one", rig.frames[:1]))
