"""Sessions of ONNX networks, cached while they are used, with limits on time and memory."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

import onnxruntime

from packetmesh.errors import InputError
from packetmesh.memory import at_most_further
from pipeline.types import FloatArray

PREFERRED_PROVIDERS = ("CUDAExecutionProvider", "CPUExecutionProvider")
THREADS = 2
MOST_SECONDS = 60.0
"""Time limit for loading a network, and for one image."""
MOST_BYTES = 1_500_000_000
"""Memory limit in addition to twice the file's size, for its weights and their packed copy."""


def modified_ns(model_path: Path) -> int:
    """Return the time of the last change of a network's file, nanoseconds.

    Raises:
        InputError: there is no such file.
    """
    if not model_path.is_file():
        raise InputError(f"There is no network file at {model_path}: name an ONNX file, or none at all.")
    return model_path.stat().st_mtime_ns


@lru_cache(maxsize=2)
def open_session(model_path: Path, modified_ns: int) -> onnxruntime.InferenceSession:
    """Open a session with two non-spinning threads.

    The last two sessions are cached, because opening one takes as long as a run. ``modified_ns`` is the time
    of the file's last change: a changed file is opened again.

    Raises:
        InputError: the file is no ONNX network, or needs too much time or memory.
    """
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = THREADS
    options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 4
    available = onnxruntime.get_available_providers()
    providers = [name for name in PREFERRED_PROVIDERS if name in available]
    try:
        with _bounded(model_path, lambda: options.set_load_cancellation_flag(True)):
            return onnxruntime.InferenceSession(str(model_path), options, providers=providers)
    except Exception as error:  # onnxruntime raises a dozen unrelated types for damaged files
        raise InputError(
            f"{model_path} is not a readable ONNX network, is cut short, or needs more than "
            f"{MOST_SECONDS:g} s or {MOST_BYTES / 1e9:g} GB beyond twice its size: export or download it "
            "again, or take a smaller one."
        ) from error


def run_session(
    session: onnxruntime.InferenceSession, model_path: Path, output: str, image: dict[str, FloatArray]
) -> FloatArray:
    """Run the network on one image; returns the named output.

    Raises:
        Exception: an onnxruntime error, if the network cannot process the image.
        MemoryError, TimeoutError: the network needs too much memory or time.
    """
    options = onnxruntime.RunOptions()
    late = threading.Event()

    def end() -> None:
        late.set()
        options.terminate = True

    try:
        with _bounded(model_path, end):
            (values,) = session.run([output], image, options)
    except Exception as error:
        if late.is_set():
            raise TimeoutError(f"more than {MOST_SECONDS:g} s for an image") from error
        if "Failed to allocate memory" in str(error) or "bad_alloc" in str(error):
            raise MemoryError(f"more than {MOST_BYTES / 1e9:g} GB beyond twice its size") from error
        raise
    return values


@contextmanager
def _bounded(model_path: Path, end: Callable[[], object]) -> Iterator[None]:
    """Limit memory in the body, and call ``end`` after the time limit."""
    timer = threading.Timer(MOST_SECONDS, end)
    timer.daemon = True
    timer.start()
    try:
        with at_most_further(MOST_BYTES + 2 * model_path.stat().st_size):
            yield
    finally:
        timer.cancel()
