"""The scripts in docs/examples, run as a reader runs them."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest

from pipeline.io.meshes import read_mesh
from tests.paths import ROOT

EXAMPLES = ROOT / "docs" / "examples"


def run(script: str, *arguments: object) -> str:
    """What the script prints."""
    command = [sys.executable, EXAMPLES / script, *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def curves(html: str) -> dict[str, list[float]]:
    """The y values of a plotly page's curves, by name."""
    start = re.search(r'Plotly\.newPlot\(\s*"[^"]*",\s*', html).end()
    traces, _ = json.JSONDecoder().raw_decode(html[start:])
    return {trace["name"]: trace["y"] for trace in traces}


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_a_script_is_short_and_begins_with_its_title(path):
    lines = path.read_text().splitlines()
    assert lines[0].startswith('"""')
    assert lines[0].endswith(".")
    assert len(lines) <= 40


def test_two_clouds_are_registered_and_both_convergences_plotted(tmp_path):
    printed = run("register_two_clouds.py", tmp_path)
    found = re.findall(r"([\w-]+): ([\d.]+) mm -> ([\d.]+) mm in (\d+) iterations", printed)
    errors_mm = {name: (float(first), float(last), int(steps)) for name, first, last, steps in found}
    plotted = curves((tmp_path / "convergence.html").read_text())
    assert set(plotted) == set(errors_mm) == {"ICP", "CEICP-A"}
    for name, (first, last, steps) in errors_mm.items():
        assert len(plotted[name]) == steps + 1
        assert plotted[name][0] == pytest.approx(first, abs=0.06)
        assert plotted[name][-1] == pytest.approx(last, abs=0.06)
    assert errors_mm["CEICP-A"][1] < errors_mm["ICP"][1] < errors_mm["ICP"][0]
    assert errors_mm["CEICP-A"][1] < 10.0


def test_a_rig_becomes_a_mesh_that_misses_fewer_rays(tmp_path):
    printed = run("rig_to_mesh.py", tmp_path, "--rig", "box-on-table", "--max-points", 5000)
    before, after = (float(share) for share in re.findall(r"fusion: ([\d.]+)%", printed))
    assert 0.0 < after < before < 100.0
    mesh = read_mesh(tmp_path / "mesh.glb")
    assert f"{len(mesh.triangles)} triangles" in printed
    assert len(mesh.triangles) > 1000
    assert np.ptp(mesh.vertices_m, axis=0).max() < 10.0


def test_a_network_run_gives_a_positive_delay_for_each_image_that_arrived(tmp_path):
    printed = run("network_delay.py", tmp_path, "--seconds", 4)
    arrived, created = (int(count) for count in re.search(r"(\d+) of (\d+) images", printed).groups())
    delays_s = np.loadtxt(tmp_path / "delays_s.txt")
    assert 0 < arrived <= created <= 8 * 4
    assert len(delays_s) == arrived
    assert (delays_s > 69_000 * 8 / 11e6).all()  # no faster than the channel's rate
    assert (delays_s < 4.0).all()
    median_s = float(re.search(r"median ([\d.]+) s", printed).group(1))
    assert median_s == pytest.approx(np.median(delays_s), abs=6e-4)
    assert "Plotly.newPlot" in (tmp_path / "delay.html").read_text()
