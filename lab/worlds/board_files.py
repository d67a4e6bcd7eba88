"""Board views on disk: ``BOARD/node_00/{color_00.jpg, depth_00.png}``..., ``board.json``, ``truth.json``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from lab.worlds.board_views import BoardCamera, BoardImage, BoardViews
from lab.worlds.depth_bias import DepthBias
from packetmesh.errors import InputError
from packetmesh.files import atomic_path, read_json, writable_folder, write_json
from pipeline.calibration.board import Board
from pipeline.calibration.shots import read_board
from pipeline.io.images import read_color, read_depth, write_depth_mm
from pipeline.types import CameraIntrinsics, DepthMap

BOARD_NAME, TRUTH_NAME = "board.json", "truth.json"
JPEG_QUALITY = 92


def save_board_views(folder: Path, views: BoardViews) -> None:
    """Write the images, the board's description and the truth; a depth image only if it has a known pixel.

    Images of an earlier rendering are deleted first.

    Raises:
        InputError: the folder cannot be written.
    """
    _delete_images(writable_folder(folder))
    for moment, images in enumerate(views.images):
        for node, image in enumerate(images):
            place = folder / f"node_{node:02d}"
            with atomic_path(place / f"color_{moment:02d}.jpg") as sibling:
                bgr = image.rgb[..., ::-1]
                coded = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
                sibling.write_bytes(coded.tobytes())
            if image.depth.valid.any():
                write_depth_mm(place / f"depth_{moment:02d}.png", image.depth)
    write_json(folder / BOARD_NAME, _described(views.board))
    cameras = {f"node_{node:02d}": _camera(camera) for node, camera in enumerate(views.cameras)}
    poses = [T.tolist() for T in views.T_world_board]
    write_json(folder / TRUTH_NAME, {"cameras": cameras, "T_world_board": poses})


def load_board_views(folder: Path) -> BoardViews:
    """Read board views; colours have the errors of JPEG, and depth is rounded to the millimetre.

    Raises:
        InputError: a file is missing or cannot be used.
    """
    board = read_board(folder / BOARD_NAME)
    truth = read_json(folder / TRUTH_NAME, "truth")
    try:
        cameras = tuple(_camera_in(values) for values in truth["cameras"].values())
        poses = tuple(np.array(T, float).reshape(4, 4) for T in truth["T_world_board"])
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"{folder} does not hold rendered board views ({error}); render them again"
        ) from None
    images = tuple(
        tuple(_image(folder / f"node_{node:02d}", moment) for node in range(len(cameras)))
        for moment in range(len(poses))
    )
    return BoardViews(board, cameras, poses, images)


def _image(folder: Path, moment: int) -> BoardImage:
    rgb = read_color(folder / f"color_{moment:02d}.jpg")
    depth = folder / f"depth_{moment:02d}.png"
    if depth.exists():
        return BoardImage(rgb, read_depth(depth))
    return BoardImage(rgb, DepthMap(np.full(rgb.shape[:2], np.nan, np.float32)))


def _delete_images(folder: Path) -> None:
    """Delete the images of a rendering, and the nodes' folders that are empty without them."""
    for node in folder.glob("node_*"):
        for image in (*node.glob("color_*.jpg"), *node.glob("depth_*.png")):
            image.unlink()
        if not any(node.iterdir()):
            node.rmdir()


def _described(board: Board) -> dict[str, Any]:
    """Return the values of ``board.json``: a dictionary only if one is chosen, the gap only between tags."""
    values: dict[str, Any] = {
        "pattern": board.pattern,
        "columns": board.columns,
        "rows": board.rows,
        "spacing_mm": round(1000.0 * board.spacing_m, 6),
    }
    if board.dictionary:
        values["dictionary"] = board.dictionary
    if board.pattern == "aprilgrid":
        values["tag_spacing"] = board.tag_spacing
    return values


def _camera(camera: BoardCamera) -> dict[str, Any]:
    lens, bias = camera.intrinsics, camera.bias
    return {
        "width": lens.width_px,
        "height": lens.height_px,
        "fx": lens.fx_px,
        "fy": lens.fy_px,
        "cx": lens.cx_px,
        "cy": lens.cy_px,
        "distortion": lens.distortion.tolist(),
        **({"fisheye": True} if lens.fisheye else {}),
        "T_world_camera": camera.T_world_camera.tolist(),
        "depth_bias": {
            "a_m": bias.a_m,
            "b": bias.b,
            "c_per_m": bias.c_per_m,
            "waves": bias.waves.tolist(),
        },
    }


def _camera_in(values: dict[str, Any]) -> BoardCamera:
    fx, fy, cx, cy = (float(values[key]) for key in ("fx", "fy", "cx", "cy"))
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    distortion, fisheye = np.array(values["distortion"], float), bool(values.get("fisheye", False))
    lens = CameraIntrinsics(matrix, distortion, int(values["width"]), int(values["height"]), fisheye)
    bias = values["depth_bias"]
    found = DepthBias(bias["a_m"], bias["b"], bias["c_per_m"], np.array(bias["waves"], float))
    return BoardCamera(lens, np.array(values["T_world_camera"], float).reshape(4, 4), found)
