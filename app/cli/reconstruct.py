"""``packetmesh reconstruct``: the whole way from images to a surface."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.options import PresetName, Settings
from app.cli.text import print_json, say, say_progress, wrong_use
from packetmesh.progress import drain
from packetmesh.settings import config_named, with_settings
from pipeline.config import PRESETS

if TYPE_CHECKING:
    from pipeline.sources import FileSource


def reconstruct(
    out: Path,
    scene: str | None = None,
    rig: Path | None = None,
    color: Path | None = None,
    depth: Path | None = None,
    intrinsics: Path | None = None,
    depth_scale: float = 1000.0,
    preset: PresetName = "packetmesh",
    set: Settings = (),
    json: bool = False,
) -> None:
    """Go the whole way from images to a surface before and after fusion.

    Args:
        out: Folder for config.json, metrics.json, the clouds, the surfaces and report.html.
        scene: A demo scene (see `packetmesh scenes`).
        rig: A folder with node_00/{color.png, depth.png, intrinsics.json, pose.txt}, node_01/...
        color: Colour image of a single RGB-D pair.
        depth: Its registered 16-bit depth image.
        intrinsics: Its camera: JSON with fx, fy, cx, cy; Open3D JSON; or ROS camera_info.
        depth_scale: Depth units per metre in the depth image.
        preset: Settings to start from.
        set: Settings to change, for example `--set depth.alignment=median surface.max_points=20000`.
        json: Print the metrics as one JSON object.
    """
    source = source_named(scene, rig, color, depth, intrinsics, depth_scale)
    config = with_settings(config_named(preset, PRESETS), set)

    from app.reports.reconstruction import write_reconstruction_report
    from packetmesh.files import writable_folder
    from pipeline.reconstruct import iterate_reconstruction
    from pipeline.run_folder import metrics_of, write_run_folder
    from pipeline.spec import Spec
    from pipeline.stages import RunCache, run

    spec, cache = Spec(source, preset, config), RunCache()
    drain(run(spec, cache, ["rig"]))  # images that cannot be used leave no folder
    writable_folder(out)
    result = drain(iterate_reconstruction(spec, cache), say_progress)
    metrics = metrics_of(result)
    write_run_folder(result, metrics, out)
    write_reconstruction_report(result, metrics, out / "report.html")
    before, after = metrics["surface_before"], metrics["surface_after"]
    say(
        f"100%  rays without a surface: {before['no_hit_ray_share']:.1%} before fusion, "
        f"{after['no_hit_ray_share']:.1%} after; see {out / 'report.html'}"
    )
    if not after["triangles"]:
        say("The ball falls through everywhere; try larger surface.radii_m")
    if json:
        print_json(metrics)


def source_named(
    scene: str | None,
    rig: Path | None,
    color: Path | None,
    depth: Path | None,
    intrinsics: Path | None,
    depth_scale: float,
) -> FileSource:
    """What the options name."""
    pair = (color, depth, intrinsics)
    ways = [scene is not None, rig is not None, any(part is not None for part in pair)]
    if sum(ways) != 1:
        wrong_use("say what to reconstruct: --scene NAME, --rig DIR, or --color C --depth D --intrinsics K")
    from pipeline.sources import Demo, ImagePair, RigFolder

    if scene is not None:
        return Demo(scene)
    if rig is not None:
        return RigFolder(str(rig))
    if color is None or depth is None or intrinsics is None:
        wrong_use("a single pair needs all of --color, --depth and --intrinsics")
    return ImagePair(str(color), str(depth), str(intrinsics), depth_scale)
