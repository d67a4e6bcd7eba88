"""Text, JSON, bags and networks that are bad in ways of their own."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from tests.bad_input import networks
from tests.bad_input.geometry import Made
from tests.bad_input.samples import data_of, samples

DEEP = 10_000


def numbers_in_text() -> Iterator[Made]:
    """JSON, YAML and text."""
    jsons = [one.name for one in samples() if one.name.endswith(".json")]
    for name in jsons:
        if name in ("config.json", "own.json"):
            yield name, "100 MB", lambda: b'{"a": "' + b"x" * 100_000_000 + b'"}'
        yield name, f"lists {DEEP} deep", b"[" * DEEP + b"]" * DEEP
        yield name, f"objects {DEEP} deep", b'{"a":' * DEEP + b"1" + b"}" * DEEP
        yield name, "a number of 100,000 digits", b'{"width": ' + b"9" * 100_000 + b"}"
        yield name, "null", b"null"
        yield name, "a list", b"[1, 2, 3]"
        yield name, "UTF-16", '{"a": 1}'.encode("utf-16")
        good = data_of(name)
        for what in ("NaN", "1e999", "-1", "0", '"x"', "null", "[]", "{}", "[[[]]]", "1" + "0" * 30):
            damaged = _with_numbers(good, what.encode())
            yield name, f"{what[:9]} for its numbers", damaged
    for name in ("of_camera.yaml", "of_camera_info.yaml", "camchain.yaml", "of_cameras.txt", "of_matlab.txt"):
        good = data_of(name)
        for what in ("nan", "1e999", "-1", "0", "x"):
            yield name, f"{what} for its numbers", _with_numbers(good, what.encode())
        yield name, "anchors that multiply", _laughs()
        yield name, "one line of 900,000 brackets", b"camera_matrix: " + b"[" * 900_000
        yield name, "900,000 spaces", b"fx:" + b" " * 900_000 + b"1"
    yield "of_camera.yaml", "three coefficients of five", _with_five_rows()
    for name in ("pose.txt", "matrix.txt", "link.txt", "traj.log", "rgb.txt"):
        good = data_of(name)
        for what in ("nan", "inf", "1e999", "x"):
            yield name, f"{what} for its numbers", _with_numbers(good, what.encode())
    yield "of_camera.yaml", "100 MB", lambda: b"a: 1\n" * 20_000_000
    yield "pose.txt", "100 MB", lambda: b"1 0 0 0\n" * 12_500_000
    yield "link.txt", "100 MB", lambda: b"0 1 1 0\n" * 12_500_000
    yield "link.txt", "times that fall", b"5 1 1 0\n4 1 1 0\n"
    yield "link.txt", "5 columns", b"0 1 1 0 9\n"
    yield "config.json", "settings that are not known", b'{"settings": {"no.such": "1"}}'
    yield "config.json", "settings that are lists", b'{"settings": [1]}'
    yield (
        "board.json",
        "10^12 columns",
        b'{"pattern":"circles","columns":1000000000000,"rows":9,"spacing_mm":1}',
    )
    yield "board.json", "no known pattern", b'{"pattern":"stripes","columns":9,"rows":9,"spacing_mm":1}'
    yield (
        "board.json",
        "a pattern of 900,000 letters",
        b'{"pattern":"' + b"x" * 900_000 + b'","columns":9,"rows":9,"spacing_mm":1}',
    )


def _with_numbers(data: bytes, what: bytes) -> bytes:
    """A text whose numbers are all something else."""
    return re.sub(rb"(?<![\w.])-?\d[\d.e+-]*", what, data)


def _laughs() -> bytes:
    """YAML's billion laughs."""
    lines = ["a: &a [1,1,1,1,1,1,1,1,1]"]
    lines += [f"{b}: &{b} [{','.join([f'*{a}'] * 9)}]" for a, b in zip("abcdefgh", "bcdefghi", strict=True)]
    return "\n".join(lines).encode()


def _with_five_rows() -> bytes:
    good = data_of("of_camera.yaml")
    head, _, tail = good.rpartition(b"data: [")
    return head + b"data: [" + b",".join(tail.split(b",")[:3]) + b"]\n"


def bags() -> Iterator[Made]:
    """Bags with damage in the middle."""
    for name in ("a.bag", "a.db3", "a.mcap"):
        good = data_of(name)
        for share in range(10):
            at = len(good) * share // 10
            yield (
                name,
                f"bytes of {share} tenths inverted",
                good[:at] + bytes(255 - b for b in good[at : at + 64]) + good[at + 64 :],
            )
            huge = good[:at] + b"\xff" * 8 + good[at + 8 :]
            yield name, f"a size of 2^64 after {share} tenths", huge


def unwanted_networks() -> Iterator[Made]:
    yield "a.onnx", "100 GB at once", networks.that_wants(100 << 30)
    yield "a.onnx", "3 GB at once", networks.that_wants(3 << 30)
    yield "a.onnx", "a constant of 100 GB", networks.that_expands(100 << 30)
    yield "a.onnx", "a constant of 3 GB", networks.that_expands(3 << 30)
    yield "a.onnx", "a loop that never ends", networks.that_never_ends()
    yield "a.onnx", "a loop that collects for ever", networks.that_collects()
    yield "a.onnx", "weights in ../good.png", networks.with_weights_in("../good.png")
    yield "a.onnx", "weights in /etc/passwd", networks.with_weights_in("/etc/passwd")
    yield "a.onnx", "an output of three numbers a pixel", networks.with_output((4, 7, 7))
    yield "a.onnx", "NaN everywhere", networks.that_answers(np.nan)
    yield "a.onnx", "nothing but zero", networks.that_answers(0.0)
