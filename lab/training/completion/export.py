"""Export of a trained completion network to the ONNX file that ships."""

from __future__ import annotations

from pathlib import Path

import onnx
import torch

from lab.training.completion.network import CompletionNet
from packetmesh.errors import InputError
from packetmesh.files import atomic_path
from pipeline.depth.slopes import CHANNELS_IN, GRID_WIDTH_PX, MULTIPLE

OPSET = 17
GRID_HEIGHT_PX = 128
SIDES = {2: "height", 3: "width"}
FACTS = {
    "licence": "Apache-2.0",
    "description": "depth completion: differences of logarithmic depth and how sure they are",
    "trained on": "rendered rooms only; no weights of others",
}


def export_completion(checkpoint: Path, out: Path) -> int:
    """Write the ONNX file of a checkpoint, with its training in the metadata.

    Returns:
        The file's size in bytes.

    Raises:
        InputError: the checkpoint is missing, or of another network.
    """
    if not checkpoint.is_file():
        raise InputError(f"There is no checkpoint at {checkpoint}: train a completion network first.")
    saved = torch.load(checkpoint, weights_only=True, map_location="cpu")
    model = CompletionNet().eval()
    try:
        model.load_state_dict(saved["model"])
    except (KeyError, RuntimeError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{checkpoint} is of another network ({reason}): train again.") from None
    example = torch.zeros(1, CHANNELS_IN, GRID_HEIGHT_PX, GRID_WIDTH_PX)
    with atomic_path(out) as temporary:
        torch.onnx.export(
            model,
            (example,),
            str(temporary),
            input_names=["planes"],
            output_names=["differences"],
            dynamic_axes={"planes": SIDES, "differences": SIDES},
            opset_version=OPSET,
            dynamo=False,
        )
        graph = onnx.load(temporary)
        onnx.helper.set_model_props(graph, FACTS | facts(saved) | {"multiple_px": str(MULTIPLE)})
        onnx.save(graph, temporary)
    return out.stat().st_size


def facts(saved: dict) -> dict[str, str]:
    """Return the facts about the training that the file repeats."""
    chosen = ("minutes", "seed", "learning_rate", "batch")
    named = saved["state"] | {key: saved["config"][key] for key in chosen}
    return {name: str(value) for name, value in named.items()}
