"""ONNX networks opened to be run, and kept while they are used."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import onnxruntime

from packetmesh.errors import InputError

PREFERRED_PROVIDERS = ("CUDAExecutionProvider", "CPUExecutionProvider")
THREADS = 2


def modified_ns(model_path: Path) -> int:
    """When a network's file was last written."""
    if not model_path.is_file():
        raise InputError(f"There is no depth network at {model_path}: name an ONNX file, or none at all.")
    return model_path.stat().st_mtime_ns


@lru_cache(maxsize=2)
def open_session(model_path: Path, modified_ns: int) -> onnxruntime.InferenceSession:
    """A session with few, non-spinning threads; the last two are kept: opening takes as long as inferring."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = THREADS
    options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 4
    available = onnxruntime.get_available_providers()
    providers = [name for name in PREFERRED_PROVIDERS if name in available]
    try:
        return onnxruntime.InferenceSession(str(model_path), options, providers=providers)
    except Exception as error:  # onnxruntime raises a dozen unrelated types for damaged files
        raise InputError(
            f"{model_path} is not a readable ONNX network, or is cut short: export or download it again."
        ) from error
