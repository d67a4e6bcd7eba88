"""The notebooks in docs/examples, run cell by cell as Jupyter runs them."""

import json
import os
import subprocess
import sys

import pytest

from tests.paths import ROOT

NOTEBOOKS = sorted((ROOT / "docs" / "examples").glob("*.ipynb"))
RUN = """
import json, sys
import nbformat
from IPython.core.interactiveshell import InteractiveShell

shell, shown = InteractiveShell.instance(), []
for cell in nbformat.read(sys.argv[1], as_version=4).cells:
    if cell.cell_type == "code":
        done = shell.run_cell(cell.source)
        done.raise_error()
        if done.result is not None:
            shown.append([type(done.result).__name__, getattr(done.result, "_repr_html_", str)()])
values = {name: value for name, value in shell.user_ns.items() if name in sys.argv[3:]}
with open(sys.argv[2], "w", encoding="utf-8") as file:
    json.dump({"shown": shown, "values": values}, file, default=float)
"""
"""Runs a notebook in the shell that Jupyter's kernel is made of."""


def run(tmp_path, name, *values):
    """What the cells show, as kind and HTML, and the final values of some names."""
    file = tmp_path / "shown.json"
    notebook = ROOT / "docs" / "examples" / f"{name}.ipynb"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "IPYTHONDIR": str(tmp_path)}
    command = [sys.executable, "-c", RUN, notebook, file, *values]
    done = subprocess.run(
        command, capture_output=True, text=True, env=environment, check=False, cwd=tmp_path, timeout=120
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    found = json.loads(file.read_text("utf-8"))
    return found["shown"], found["values"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_its_outputs_and_begins_with_its_title(path):
    cells = json.loads(path.read_text("utf-8"))["cells"]
    assert cells[0]["cell_type"] == "markdown"
    assert "".join(cells[0]["source"]).startswith("# ")
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)
    site = (ROOT / "docs" / "examples.md").read_text("utf-8")
    assert f"examples/{path.stem}\n" in site


def test_two_clouds_are_registered_and_watched(tmp_path):
    shown, values = run(tmp_path, "watch_a_registration", "errors_mm")
    assert [kind for kind, _ in shown] == ["Rig", "PointCloud", "RegistrationResult", "Shown", "Figure"]
    icp_mm, ceicp_mm = values["errors_mm"]["icp"], values["errors_mm"]["ceicp-a"]
    assert icp_mm[0] == ceicp_mm[0] > 100.0
    assert ceicp_mm[-1] < 10.0 < icp_mm[-1] < 50.0
    assert f"after {len(ceicp_mm) - 1} iterations" in shown[2][1]
    assert "VISER_EMBED_DATA" in shown[3][1]


def test_the_radius_is_tuned(tmp_path):
    shown, values = run(tmp_path, "tune_the_radius", "factors", "used", "areas_m2", "spacing_m", "radii_m")
    assert [kind for kind, _ in shown] == ["PointCloud", "Figure", "Shown", "Surface", "Shown"]
    used, areas_m2 = values["used"], values["areas_m2"]
    best = used.index(max(used))
    assert 0 < best < len(used) - 1, "both the smallest and the largest ball leave points out"
    assert areas_m2 == sorted(areas_m2)
    assert len(used) == len(values["factors"])
    assert values["radii_m"][0] == values["spacing_m"]
    assert f"{1000 * values['radii_m'][-1]:.1f} mm" in shown[3][1]
