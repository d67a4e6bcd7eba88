"""Simulate a camera network, and plot how long its images take to the sink.

Eight cameras in an office each send one image a second over the same IEEE 802.11b channel. An image that
finds the channel free takes the shortest time; the others wait for each other's frames.
"""

import argparse
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

import packetmesh as pm

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("out", nargs="?", default="runs/examples", type=Path, help="folder for delay.html")
parser.add_argument("--seconds", default=30.0, type=float, help="simulated time")
arguments = parser.parse_args()
arguments.out.mkdir(parents=True, exist_ok=True)

changes = ["nodes.count=8", "nodes.interval_s=1", "nodes.depth_bytes=0", f"run.horizon_s={arguments.seconds}"]
trace = pm.simulate(pm.with_settings(pm.NETWORK_PRESETS["office"], changes))
delays_s = pm.image_delays_s(trace)
np.savetxt(arguments.out / "delays_s.txt", delays_s)

images = trace.counters.images
print(f"{images.arrived} of {images.created} images arrived")
print(f"delay: median {np.median(delays_s):.3f} s, 95 % within {np.percentile(delays_s, 95):.3f} s")

figure = go.Figure(go.Histogram(x=delays_s, nbinsx=40))
figure.update_layout(title="Delay of images", xaxis_title="delay (s)", yaxis_title="images")
figure.write_html(arguments.out / "delay.html")
