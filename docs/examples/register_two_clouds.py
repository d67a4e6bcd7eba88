"""Register two clouds with ICP and with CEICP-A, and plot how fast each converges.

Two depth cameras look at one living room. Each knows its pose only roughly; registration corrects it. The
room is rendered, so the true pose is known and the error of every iteration can be measured.
"""

import argparse
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

import packetmesh as pm

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("out", nargs="?", default="runs/examples", type=Path, help="folder for convergence.html")
out = parser.parse_args().out
out.mkdir(parents=True, exist_ok=True)

rig = pm.load_demo("living-room")
target, source = (pm.back_project(frame) for frame in rig.frames[:2])
T_world_target, T_world_source = (frame.T_world_camera for frame in rig.frames[:2])
T_start = np.linalg.inv(T_world_target) @ T_world_source
T_true = np.linalg.inv(rig.truth.T_world_camera[0]) @ rig.truth.T_world_camera[1]

figure = go.Figure()
for method in ("icp", "ceicp-a"):
    steps = pm.iterate_registration(source, target, pm.RegistrationConfig(method), T_start)
    poses = [T_start, *(step.T_target_source for step in steps)]
    errors_mm = [1000 * pm.point_error_m(T, T_true, source.points_m) for T in poses]
    figure.add_scatter(y=errors_mm, name=method.upper(), mode="lines+markers")
    print(f"{method.upper()}: {errors_mm[0]:.1f} mm -> {errors_mm[-1]:.1f} mm in {len(poses) - 1} iterations")

figure.update_layout(title="Two views of a living room", xaxis_title="iteration", yaxis_title="error (mm)")
figure.update_yaxes(type="log")
figure.write_html(out / "convergence.html")
