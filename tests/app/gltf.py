"""Binary glTF read back, to see what a browser gets."""

import json
import struct

import numpy as np

TYPES = {5126: "<f4", 5123: "<u2", 5125: "<u4"}


def arrays(glb):
    """The primitive's mode and its arrays, read as the glTF 2.0 specification says."""
    magic, version, total = struct.unpack_from("<4sII", glb)
    assert (magic, version, total) == (b"glTF", 2, len(glb))
    size, kind = struct.unpack_from("<I4s", glb, 12)
    head, body = json.loads(glb[20 : 20 + size]), glb[28 + size :]
    assert kind == b"JSON"
    assert struct.unpack_from("<I4s", glb, 20 + size) == (len(body), b"BIN\0")
    assert head["extensionsUsed"] == list(head["materials"][0]["extensions"]) == ["KHR_materials_unlit"]

    def array(row):
        accessor = head["accessors"][row]
        view = head["bufferViews"][accessor["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        flat = np.frombuffer(body, TYPES[accessor["componentType"]], offset=view["byteOffset"])
        wide = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        return flat[: wide * accessor["count"]].reshape(-1, wide)

    (primitive,) = head["meshes"][0]["primitives"]
    read = {name: array(row) for name, row in primitive["attributes"].items()}
    if "indices" in primitive:
        read["indices"] = array(primitive["indices"]).reshape(-1, 3)
    return primitive["mode"], read


def srgb(linear):
    linear = linear / 65535.0
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
