"""Binary glTF read back, to see what a browser gets."""

import json
import struct

import numpy as np

TYPES = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
WIDE = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def arrays(glb):
    """The primitive's mode and its arrays, read as glTF 2.0 says; positions in metres."""
    magic, version, total = struct.unpack_from("<4sII", glb)
    assert (magic, version, total) == (b"glTF", 2, len(glb))
    size, kind = struct.unpack_from("<I4s", glb, 12)
    head, body = json.loads(glb[20 : 20 + size]), glb[28 + size :]
    assert kind == b"JSON"
    assert struct.unpack_from("<I4s", glb, 20 + size) == (len(body), b"BIN\0")
    required = head.get("extensionsRequired", [])
    quantized = "KHR_mesh_quantization" in required
    assert set(required) <= {"KHR_mesh_quantization", "EXT_texture_webp"}
    assert head["extensionsUsed"] == [*head["materials"][0]["extensions"], *required]
    assert list(head["materials"][0]["extensions"]) == ["KHR_materials_unlit"]

    def array(row):
        accessor = head["accessors"][row]
        view = head["bufferViews"][accessor["bufferView"]]
        kind, wide = TYPES[accessor["componentType"]], WIDE[accessor["type"]]
        stride = view.get("byteStride", wide * np.dtype(kind).itemsize)
        assert view["byteOffset"] % 4 == 0
        assert stride % 4 == 0 or wide == 1
        assert stride * accessor["count"] == view["byteLength"]
        found = np.ndarray((accessor["count"], wide), kind, body, view["byteOffset"], (stride, int(kind[-1])))
        if "min" in accessor:
            assert found.min(axis=0).tolist() == accessor["min"]
            assert found.max(axis=0).tolist() == accessor["max"]
        return found

    (primitive,) = head["meshes"][0]["primitives"]
    read = {name: array(row) for name, row in primitive["attributes"].items()}
    (node,) = head["nodes"]
    if quantized:
        assert read["POSITION"].dtype.kind == "u"
        read["POSITION"] = read["POSITION"] * np.array(node["scale"]) + node["translation"]
    if "indices" in primitive:
        corners = {1: 2, 4: 3}[primitive["mode"]]
        read["indices"] = array(primitive["indices"]).reshape(-1, corners)
    return primitive["mode"], read


def srgb(linear):
    linear = linear / 65535.0
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
