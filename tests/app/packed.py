"""Packed contents read back, as the text of ``app/drawing/packing.py`` says, number by number."""

import json
import struct

import numpy as np

from tests.app.gltf import srgb


def unpacked(packed):
    """The bytes of a content."""
    (length,) = struct.unpack_from("<I", packed)
    parts, at, pieces, triangles = json.loads(packed[4 : 4 + length]), 4 + length, [], None
    for kind, *numbers in parts:
        size, write = KINDS[kind](*numbers)
        pieces.append((kind, write, packed[at : at + size]))
        if kind == "triangles":
            triangles = write(packed[at : at + size]), numbers[1]
        at += size
    assert at == len(packed)
    return b"".join(
        write(data, *triangles) if kind == "vertices" else write(data) for kind, write, data in pieces
    )


def _raw(count):
    return count, lambda data: data


def _rows(rows, columns, size, stride):
    def write(data):
        found = [_summed(column, size) for column in _columns(data, rows, columns, size)]
        wide = [b"".join(one[row].to_bytes(size, "little") for one in found) for row in range(rows)]
        return b"".join(row.ljust(stride, b"\0") for row in wide)

    return rows * columns * size, write


def _vertices(rows, columns, size, stride, unit):
    def write(data, triangles, index_size):
        flat = np.frombuffer(triangles, f"<u{index_size}").tolist()
        below = {}
        for at in range(0, len(flat), 3):
            for vertex in flat[at : at + 3]:
                below.setdefault(vertex, [corner for corner in flat[at : at + 3] if corner < vertex])
        found = _columns(data, rows, columns, size)
        table = []
        for row in range(rows):
            known = [table[corner] for corner in below.get(row, [])] or table[-1:] or [(0,) * columns]
            expected = [sum(values) // len(known) for values in zip(*known, strict=True)]
            table.append(
                tuple(
                    (value + column[row]) % 256**size for value, column in zip(expected, found, strict=True)
                )
            )
        return b"".join(
            b"".join((unit * value).to_bytes(size, "little") for value in values).ljust(stride, b"\0")
            for values in table
        )

    return rows * columns * size, write


def _grid(rows, columns, bits):
    def write(data):
        found = [_summed(column, 4) for column in _columns(data, rows, columns, 4)]
        signed = [[value - (value >> 31 << 32) for value in column] for column in found]
        return b"".join(struct.pack("<f", one[row] / 2**bits) for row in range(rows) for one in signed)

    return 4 * rows * columns, write


def _triangles(rows, size):
    def write(data):
        triangles, greatest = [], -1
        for first, second, third in zip(*_columns(data, rows, 3, size), strict=True):
            above = triangles[-1] if triangles else None
            a = ((above[0] if above else 0) + first) % 256**size
            following = 1 + max(a, greatest)
            b = ((above[2] if above and above[0] == a else following) - second) % 256**size
            c = (max(following, b + 1) - third) % 256**size
            triangles.append((a, b, c))
            greatest = max(greatest, a, b, c)
        return b"".join(value.to_bytes(size, "little") for triangle in triangles for value in triangle)

    return 3 * rows * size, write


def _colors(rows):
    return 3 * rows, lambda data: bytes(value for rgb in _rgb(data, rows) for value in rgb)


def _light(rows):
    values = np.arange(65536)
    shades = 255.0 * srgb(values)
    table = [int(values[np.argmin(np.abs(shades - shade))]) for shade in range(256)]

    def write(data):
        found = ([table[value] for value in rgb] for rgb in _rgb(data, rows))
        return b"".join(struct.pack("<4H", *linear, 65535) for linear in found)

    return 3 * rows, write


KINDS = {
    "raw": _raw,
    "rows": _rows,
    "vertices": _vertices,
    "grid": _grid,
    "triangles": _triangles,
    "colors": _colors,
    "light": _light,
}


def _columns(data, rows, columns, size):
    """The differences of each column."""
    found = []
    for column in range(columns):
        planes = [data[(column * size + plane) * rows :][:rows] for plane in range(size)]
        numbers = [sum(plane[row] << 8 * place for place, plane in enumerate(planes)) for row in range(rows)]
        found.append([number // 2 if number % 2 == 0 else -(number + 1) // 2 for number in numbers])
    return found


def _summed(differences, size):
    total, values = 0, []
    for difference in differences:
        total = (total + difference) % 256**size
        values.append(total)
    return values


def _rgb(data, rows):
    """The colours of three planes."""
    green = red = blue = 0
    for row in range(rows):
        green = (green + data[row]) % 256
        red = (red + data[rows + row]) % 256
        blue = (blue + data[2 * rows + row]) % 256
        yield (red + green) % 256, green, (blue + green) % 256
