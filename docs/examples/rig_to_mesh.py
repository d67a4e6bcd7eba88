"""Reconstruct a rig of depth cameras, and save the surface as a mesh.

A depth camera leaves holes. The chain infers the missing depth from the colour images, registers the cameras
to each other, and rolls a ball over the points. It is judged by the cameras' rays that meet no surface.
"""

import argparse
from pathlib import Path

import packetmesh as pm

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("out", nargs="?", default="runs/examples", type=Path, help="folder for mesh.glb")
parser.add_argument(
    "--rig", default="living-room", help="a demo scene, or a folder with node_00, node_01, ..."
)
parser.add_argument("--max-points", default=30_000, type=int, help="points that the ball rolls over")
arguments = parser.parse_args()

name = arguments.rig
rig = pm.load_demo(name) if name in pm.DEMO_SCENES else pm.load_rig(name)
config = pm.with_settings(pm.PRESETS["packetmesh"], [f"surface.max_points={arguments.max_points}"])
result = pm.reconstruct(rig, config)

print(f"rays without a surface before fusion: {result.before.quality.no_hit_ray_share:.1%}")
print(f"rays without a surface after fusion: {result.after.quality.no_hit_ray_share:.1%}")

file = arguments.out / "mesh.glb"
pm.write_mesh(file, result.after)
print(f"{len(result.after.triangles)} triangles in {file}")
