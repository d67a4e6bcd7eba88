"""The command line: one entry point; heavy imports happen inside the command that needs them.

Exit code 0: done; 1: it could not be done, one sentence says why; 2: wrong use.
With ``--json`` exactly one JSON object goes to stdout; everything else goes to stderr.
"""

from __future__ import annotations

import logging
import os
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from app.cli_depth import infer_depth
from app.cli_simulate import simulate
from app.cli_text import answers_table, mesh_lines, print_json, say, wrong_use
from pipeline.config import PRESETS
from pipeline.errors import InputError, PacketMeshError
from pipeline.settings import load_config, with_settings

Settings = Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="KEY=VALUE")]
PresetName = Annotated[str, tyro.conf.arg(metavar="{" + "|".join(PRESETS) + "|FILE.json}")]


def serve(
    scene: str = "living-room",
    preset: PresetName = "packetmesh",
    host: str = "127.0.0.1",
    port: int = 8080,
    open: bool = False,
    lecture: bool = False,
) -> None:
    """Open the app: step through a reconstruction in the browser.

    Args:
        scene: Demo scene to start with (see `packetmesh scenes`), or a rig folder.
        preset: Settings to start with.
        host: Address to listen on; other machines can reach only what is not loopback.
        port: Port to listen on.
        open: Open a browser window.
        lecture: Share one session among all browsers instead of one each.
    """
    from app.server import serve as serve_app

    def announce(url: str) -> None:
        say(f"PacketMesh is at {url} (stop with Ctrl-C)")

    serve_app(
        scene=scene,
        config=load_config(preset),
        host=host,
        port=port,
        open_browser=open,
        lecture=lecture,
        announce=announce,
    )


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
    config = with_settings(load_config(preset), set)
    name, loaded = _load(scene, rig, color, depth, intrinsics, depth_scale)

    from app.reports.reconstruction import write_reconstruction_report
    from pipeline.io.atomic import writable_folder
    from pipeline.reconstruct import iterate_reconstruction
    from pipeline.run_folder import metrics_of, write_run_folder

    writable_folder(out)
    steps = iterate_reconstruction(loaded, config)
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            result = stop.value
            break
        say(f"{progress.fraction:4.0%}  {progress.stage}")
    metrics = metrics_of(result, name, preset)
    write_run_folder(result, metrics, out, {"scene": name, "preset": preset})
    write_reconstruction_report(result, metrics, out / "report.html")
    before, after = metrics["surface_before"], metrics["surface_after"]
    say(
        f"100%  rays without a surface: {before['no_hit_ray_share']:.1%} before fusion, "
        f"{after['no_hit_ray_share']:.1%} after; see {out / 'report.html'}"
    )
    if json:
        print_json(metrics)


def register(
    source: Annotated[Path, tyro.conf.Positional],
    target: Annotated[Path, tyro.conf.Positional],
    out: Path,
    method: str = "ceicp-a",
    metric: Literal["point", "plane"] | None = None,
    init: Path | None = None,
    truth: Path | None = None,
    voxel_m: float | None = None,
    gate_m: float = 0.3,
    start: Literal["given", "global"] = "given",
    scale: bool = False,
    json: bool = False,
) -> None:
    """Move one point cloud onto another: PLY, PCD, NPZ or text (XYZ, TXT, ASC, CSV), in metres.

    Args:
        source: The cloud that moves.
        target: The cloud that stays.
        out: Folder for transform.txt, metrics.json, steps.csv, aligned.ply and config.json.
        method: A method or peer by name, or `all` to compare them; a wrong name lists them.
        metric: Residual of our methods; point to plane unless a scale is asked for.
        init: Start pose of the source in the target's frame, 4 x 4 numbers; the identity without it.
        truth: The true pose, where it is known, to measure errors by.
        voxel_m: Thin both clouds to one point per cube of this edge first.
        gate_m: Largest distance of a pair.
        start: `global` finds the start pose by matching features.
        scale: Estimate a scale as well (our methods, point metric).
        json: Print the metrics as one JSON object.
    """
    from pipeline.io.atomic import writable_folder
    from pipeline.io.clouds import read_cloud
    from pipeline.io.rigs import read_pose
    from pipeline.register_folder import answer_metrics, chosen_pose, write_register_folder
    from pipeline.register_pair import chosen_methods, config_for, prepared_pair, run_methods

    try:
        methods = chosen_methods(method)
    except InputError as error:
        wrong_use(str(error))
    config = config_for(methods, metric=metric, gate_m=gate_m, start=start, with_scale=scale)
    T_init, T_true = (None if path is None else read_pose(path) for path in (init, truth))
    moving, fixed = read_cloud(source), read_cloud(target)
    answers = []
    for answer in run_methods(methods, prepared_pair(moving, fixed, config, voxel_m, T_init, T_true), config):
        answers.append(answer)
        say(f"{answer.method}: {answer.stop_reason}")
    chosen_pose(answers)  # a run without a pose leaves no folder
    writable_folder(out)
    files = {"source": source, "target": target, "init": init, "truth": truth}
    command: dict[str, Any] = {name: None if path is None else str(path) for name, path in files.items()}
    command |= {"method": method, "voxel_m": voxel_m}
    write_register_folder(out, answers, moving, config, command, truth is not None)
    metrics = answer_metrics(answers, truth is not None)
    if json:
        print_json(metrics)
    else:
        print(answers_table(metrics))


def mesh(
    cloud: Annotated[Path, tyro.conf.Positional],
    out: Path,
    radii_m: Literal["auto"] | tuple[float, ...] = "auto",
    viewpoint: tuple[float, float, float] | None = None,
    max_points: int | None = None,
    smoothing_passes: int = 0,
    json: bool = False,
) -> None:
    """Roll a ball over a point cloud: PLY, PCD, NPZ or text (XYZ, TXT, ASC, CSV), in metres, give a mesh.

    Args:
        cloud: The points, with or without normals.
        out: The mesh: a .ply, .obj, .glb or .stl file.
        radii_m: Radii of the ball; `auto` takes them from the distances of the points.
        viewpoint: Where the camera was, X Y Z; normals are turned there. Without it normals stay as they
            are, or point outwards if there are none.
        max_points: Thin the cloud to about so many points first; all are used without it.
        smoothing_passes: How often every point is moved onto the plane of its neighbours.
        json: Print the quality of the mesh as one JSON object.
    """
    from pipeline.mesh_cloud import MeshOptions, iterate_mesh_file

    if radii_m == ():
        wrong_use("--radii-m needs at least one radius, or auto")
    given_m = None if radii_m == "auto" else radii_m
    options = MeshOptions(given_m, viewpoint, max_points, smoothing_passes)
    steps = iterate_mesh_file(cloud, out, options)
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            report = stop.value
            break
        say(f"{progress.fraction:4.0%}  {progress.stage}")
    if json:
        print_json(report)
    else:
        say(mesh_lines(report))


def reproduce(out: Path, only: tuple[str, ...] = (), json: bool = False) -> None:
    """Compute the thesis's claims anew and set them beside its own numbers.

    Args:
        out: Folder for reproduce.html and reproduce.json; keeps the trials of an interrupted run.
        only: Claims to compute (`--only C10 C16` or `--only C10,C16`); all without it.
        json: Print the verdicts as one JSON object.
    """
    from app.reports.reproduction import write_reproduction_report
    from network_sim.experiments.claims import CLAIMS as NETWORK_CLAIMS
    from pipeline.experiments import CLAIMS, run_experiments
    from pipeline.io.atomic import writable_folder
    from pipeline.io.json_file import write_json
    from pipeline.progress import Progress

    writable_folder(out)
    verdicts = {}
    names = [name for names in only for name in names.split(",")]
    for event in run_experiments(names, out / "trials", CLAIMS | NETWORK_CLAIMS):
        if isinstance(event, Progress):
            say(f"{event.fraction:4.0%}  {event.stage}")
            continue
        say(f"{event.id}  {event.verdict}: {event.why}")
        verdicts[event.id] = event
    report = {key: verdict.record() for key, verdict in verdicts.items()}
    write_json(out / "reproduce.json", report)
    write_reproduction_report(list(verdicts.values()), out / "reproduce.html")
    if json:
        print_json(report)


def bench(out: Path, only: tuple[str, ...] = (), json: bool = False) -> None:
    """Measure speed and memory beside peers, in one run.

    Args:
        out: Folder for bench.json.
        only: Cases to run; all without it.
        json: Print the results as one JSON object.
    """
    from network_sim.experiments.benchmarks import CASES as NETWORK_CASES
    from pipeline.experiments.benchmarks import CASES, run_benchmarks
    from pipeline.io.atomic import writable_folder
    from pipeline.io.json_file import write_json

    writable_folder(out)
    results = {}
    for case, result in run_benchmarks(only, CASES | NETWORK_CASES):
        peers = ", ".join(f"{name} {seconds:.3f} s" for name, seconds in result.peers.items()) or "no peer"
        say(f"{case}: {result.ours_s:.3f} s ({peers}), {result.peak_memory_bytes / 1e6:.0f} MB at most")
        for note in result.notes:
            say(f"  {note}")
        results[case] = result.record()
    write_json(out / "bench.json", results)
    if json:
        print_json(results)


def scenes(json: bool = False) -> None:
    """List the demo scenes that can be loaded.

    Args:
        json: Print them as one JSON object.
    """
    from pipeline.scenes import DEMO_SCENES

    if json:
        print_json(DEMO_SCENES)
        return
    for name, description in DEMO_SCENES.items():
        print(f"{name:<14} {description}")


def doctor(json: bool = False) -> None:
    """Tell what this machine has, and what is wrong with it.

    Args:
        json: Print the findings as one JSON object.
    """
    from app.doctor import examine

    findings = examine()
    if json:
        print_json({finding.name: {"ok": finding.ok, "detail": finding.detail} for finding in findings})
    else:
        for finding in findings:
            print(f"{'ok ' if finding.ok else 'BAD'} {finding.name:<14} {finding.detail}")
    bad = [finding.name for finding in findings if not finding.ok]
    if bad:
        raise PacketMeshError(f"Not everything is well: {', '.join(bad)} (see above)")


COMMANDS: dict[str, Any] = {
    "serve": serve,
    "reconstruct": reconstruct,
    "register": register,
    "mesh": mesh,
    "infer-depth": infer_depth,
    "simulate": simulate,
    "reproduce": reproduce,
    "bench": bench,
    "scenes": scenes,
    "doctor": doctor,
}


def main(argv: list[str] | None = None) -> None:
    """Run one command and exit with its code."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    try:
        tyro.extras.subcommand_cli_from_dict(
            COMMANDS,
            prog="packetmesh",
            description="From a camera node's packets to a surface mesh.",
            args=argv,
            config=(tyro.conf.FlagCreatePairsOff,),
        )
        sys.stdout.flush()
    except PacketMeshError as error:
        say(f"packetmesh: {error}")
        sys.exit(1)
    except BrokenPipeError:  # whoever read the output has gone, and wants no more of it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except KeyboardInterrupt:
        say("packetmesh: stopped")
        sys.exit(130)


def _load(
    scene: str | None,
    rig: Path | None,
    color: Path | None,
    depth: Path | None,
    intrinsics: Path | None,
    depth_scale: float,
) -> tuple[str, Any]:
    """The rig that the options name, and a name for it."""
    pair = (color, depth, intrinsics)
    ways = [scene is not None, rig is not None, any(part is not None for part in pair)]
    if sum(ways) != 1:
        wrong_use("say what to reconstruct: --scene NAME, --rig DIR, or --color C --depth D --intrinsics K")
    from pipeline.io.rigs import load_frame, load_rig
    from pipeline.scenes import load_demo
    from pipeline.types import Rig

    if scene is not None:
        return scene, load_demo(scene)
    if rig is not None:
        return str(rig), load_rig(rig)
    if color is None or depth is None or intrinsics is None:
        wrong_use("a single pair needs all of --color, --depth and --intrinsics")
    return f"{color.parent.name}/{color.name}", Rig(
        color.stem, (load_frame(color, depth, intrinsics, depth_scale),)
    )


if __name__ == "__main__":
    main()
