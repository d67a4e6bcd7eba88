"""``packetmesh infer-depth``: depth images and coloured previews from photographs."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.text import print_json, say, wrong_use
from packetmesh.errors import InputError
from pipeline.config import ModelKind, NetworkPreset

if TYPE_CHECKING:
    from pipeline.depth import AlignmentResult, DepthNetwork
    from pipeline.types import ByteArray, DepthMap

FARTHEST_M = 65.534
"""Largest depth in 16 bits of millimetres; 65535 means unknown."""
PREVIEW_PERCENTILES = (2.0, 98.0)


def infer_depth(
    photos: Annotated[tuple[Path, ...], tyro.conf.Positional],
    out: Path,
    model: Path | None = None,
    preset: NetworkPreset | None = None,
    kind: ModelKind | None = None,
    size_px: tuple[int, int] | None = None,
    normalisation: Literal["imagenet", "unit", "bytes"] | None = None,
    channels: Literal["RGB", "BGR"] | None = None,
    sensor: Path | None = None,
    fill: bool = False,
    completion: Path | None = None,
    depth_scale: float | None = None,
    json: bool = False,
) -> None:
    """Infer the depth of photographs (PNG or JPEG) with our network or any other.

    Args:
        photos: Colour images; an orientation in their metadata is not applied.
        out: Folder for NAME_depth.png, 16 bits, and NAME_preview.png. Metric depth is in millimetres, 0
            where unknown; relative depth is scaled so that its largest value is 65534.
        model: An ONNX depth network; without it, the one that comes with PacketMesh.
        preset: Input and output of that network; without it, its metadata decide.
        kind: Output of the network: metres, depth up to scale, or disparity up to scale and shift.
        size_px: Width and height of its input, if the file leaves them open.
        normalisation: Input values: normalised with ImageNet's mean and deviation, from 0 to 1 (unit), or
            from 0 to 255 (bytes).
        channels: Order of its colour channels.
        sensor: Depth image of the sensor for one photograph; it makes the inferred depth metric.
        fill: Keep the measured depth and fill only its holes, as `reconstruct` does; needs --sensor.
        completion: An ONNX network that takes image and depth; with --fill it completes the measured depth,
            instead of the one that comes with PacketMesh.
        depth_scale: Depth units per metre in the sensor image; without it, whole numbers are millimetres
            and floating-point numbers metres.
        json: Print the results as one JSON object.
    """
    if not photos:
        wrong_use("infer-depth needs at least one photograph")
    if sensor is not None and len(photos) > 1:
        wrong_use("--sensor is the depth image of one photograph; give only one photograph")
    if fill and sensor is None:
        wrong_use("--fill needs the depth image whose holes are filled: --sensor DEPTH")
    if completion is not None and not fill:
        wrong_use("--completion fills the holes of measured depth: add --fill and --sensor DEPTH")
    from packetmesh.files import writable_folder
    from pipeline.depth import DepthNetwork, Overrides
    from pipeline.folders.inputs import check_inputs_stay

    stems = [photo.stem for photo in photos]
    twice = next((stem for stem in stems if stems.count(stem) > 1), None)
    if twice is not None:
        raise InputError(
            f"Two photographs are called {twice}, so their depth files would have the same name; try them "
            "one by one"
        )
    written = [path for stem in stems for path in _files(out, stem)]
    check_inputs_stay(written, [*photos, *filter(None, (sensor, model, completion))])
    network = DepthNetwork(model, preset, Overrides(kind, size_px, normalisation, channels))
    writable_folder(out)
    report = {"model": str(network.model_path), "kind": network.convention.kind, "provider": network.provider}
    say(f"{report['model']} ({report['kind']}) runs on {report['provider']}")
    inferred = {}
    for photo, record in _infer_photos(photos, network, out, sensor, depth_scale, fill, completion):
        say(_line(photo, record))
        for note in record.get("notes", ()):
            say(f"{sensor}: {note}")
        inferred[str(photo)] = record
    if json:
        print_json({**report, "photos": inferred})


def _infer_photos(
    photos: tuple[Path, ...],
    network: DepthNetwork,
    out: Path,
    sensor: Path | None,
    depth_scale: float | None,
    fill: bool,
    completion: Path | None,
) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Infer each photograph; yield it with a record of the written files."""
    from pipeline.depth import align_depth
    from pipeline.io.images import read_color, read_depth_noted

    for photo in photos:
        rgb = read_color(photo)
        read = None if sensor is None else read_depth_noted(sensor, depth_scale)
        measured = None if read is None else read.depth
        started = time.perf_counter()
        depth = network.infer(rgb)
        record: dict[str, Any] = {
            "width_px": rgb.shape[1],
            "height_px": rgb.shape[0],
            "inference_ms": 1000.0 * (time.perf_counter() - started),
        }
        if read is not None and measured is not None:
            record["notes"] = read.notes
            aligned = align_depth(depth, measured, disparity=network.convention.kind == "inverse")
            depth, record["alignment"] = aligned.depth, _alignment(aligned)
            if fill:
                depth, record["filled"] = _fill_holes(aligned, measured, rgb, network, completion)
        yield photo, record | _write_depth(depth, network.convention.kind, out, photo.stem)


def _alignment(result: AlignmentResult) -> dict[str, Any]:
    """Return a record of the alignment of the inferred depth to the sensor's (SPEC 3.5)."""
    return {
        "mode": result.mode,
        "coefficients": result.coefficients,
        "residual_rms_m": result.residual_rms_m,
        "inliers": result.inliers,
    }


def _fill_holes(
    aligned: AlignmentResult,
    measured: DepthMap,
    rgb: ByteArray,
    network: DepthNetwork,
    completion: Path | None,
) -> tuple[DepthMap, dict[str, Any]]:
    """Fill the holes of measured depth by completion, or with the user's own network (SPEC 3.6).

    Returns:
        The filled depth; the share of pixels that were filled, and their mean confidence (None without any).
    """
    import numpy as np

    from pipeline.config import DepthConfig
    from pipeline.depth import completed_by, judge
    from pipeline.depth.inference import SHIPPED_MODEL
    from pipeline.types import DepthMap

    model = None if network.model_path == SHIPPED_MODEL else str(network.model_path)
    config = DepthConfig(model=model, completion=None if completion is None else str(completion))
    completed = completed_by(config, measured, rgb) if config.completes else None
    judged = judge(aligned, measured, rgb, float("inf"), 0.0, completed)
    depth = DepthMap(np.where(measured.valid, measured.z_m, judged.depth.z_m).astype(np.float32))
    holes = ~measured.valid & depth.valid
    confidence = float(judged.confidence[holes].mean()) if holes.any() else None
    return depth, {"share": float(holes.mean()), "mean_confidence": confidence}


def _files(out: Path, stem: str) -> tuple[Path, Path]:
    """Return the files of a photograph's depth and of its preview."""
    return out / f"{stem}_depth.png", out / f"{stem}_preview.png"


def _write_depth(depth: DepthMap, kind: ModelKind, out: Path, stem: str) -> dict[str, Any]:
    """Write the depth image and its preview; return a record of their content."""
    import numpy as np

    from pipeline.io.images import write_color, write_depth_mm
    from pipeline.types import DepthMap

    image, preview = _files(out, stem)
    known = depth.z_m[depth.valid]
    record: dict[str, Any] = {"depth": str(image), "preview": str(preview), "known": depth.coverage}
    if depth.kind == "metric":
        record |= {"unit": "mm", "nearest_m": known.min(), "farthest_m": known.max()}
        write_depth_mm(image, DepthMap(np.where(depth.z_m <= FARTHEST_M, depth.z_m, np.nan)))
        record["too_far"] = float(np.mean(known > FARTHEST_M))
    else:
        values = 1.0 / depth.z_m if kind == "inverse" else depth.z_m
        record["unit"] = f"shares of the largest {'disparity' if kind == 'inverse' else 'depth'}"
        share = values.astype(np.float64) / np.nanmax(values)
        # The millimetres use all 16 bits; the least is 1 because 0 means unknown.
        write_depth_mm(image, DepthMap(np.maximum(FARTHEST_M * share, 0.001)))
    write_color(preview, _colored(depth))
    return record


def _colored(depth: DepthMap) -> Any:
    """Return a picture (H, W, 3) of the nearness 1/z: light where near, magenta where unknown."""
    import numpy as np

    from app.drawing.colors import HOLE
    from app.drawing.pictures import cividis

    nearness = 1.0 / depth.z_m
    low, high = np.nanpercentile(nearness, PREVIEW_PERCENTILES)
    level = np.clip((nearness - low) / max(high - low, 1e-12), 0.0, 1.0)
    colors = cividis(np.rint(255.0 * np.nan_to_num(level)).astype(np.uint8))
    colors[~depth.valid] = HOLE
    return colors


def _line(photo: Path, record: dict[str, Any]) -> str:
    size = f"{record['width_px']} x {record['height_px']} px"
    values = f"in {record['unit']}"
    if "nearest_m" in record:
        values = f"{record['nearest_m']:.2f} to {record['farthest_m']:.2f} m"
    if record.get("too_far"):
        values += f", {record['too_far']:.1%} of it beyond {FARTHEST_M} m and left out"
    aligned = record.get("alignment")
    if aligned is not None:
        values += f", {aligned['mode']} residual {1000.0 * aligned['residual_rms_m']:.0f} mm"
    if "filled" in record:
        values += f", {record['filled']['share']:.1%} of the pixels filled in"
    return f"{photo}: {size}, {record['inference_ms']:.0f} ms, depth {values}; see {record['depth']}"
