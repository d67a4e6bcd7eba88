"""The README and docs/using.md: short, true to the code, and without numbers of their own."""

import re
import subprocess
import sys

import pytest

from app.cli import main
from lab.results.pages import BEGIN, END
from tests.paths import ROOT

README, USING = ROOT / "README.md", ROOT / "docs" / "using.md"
FENCED = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
RESULT = re.compile(r"\d\s*(?:%|×(?!\d)|m²|(?:[kMG]i?B|[mµ]?s|[kcm]?m|min|seconds|minutes|hours|times)\b)")
"""A number with a unit, as results have."""


def blocks(path, language):
    """The code blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", path.read_text("utf-8"), re.DOTALL | re.MULTILINE)


def typed_results(page):
    """Lines that state a result, outside of code and of what `make results` writes."""
    page = re.sub(f"{re.escape(BEGIN)}.*?{re.escape(END)}", "", FENCED.sub("", page), flags=re.DOTALL)
    return [line for line in page.splitlines() if RESULT.search(line)]


def test_results_stand_only_between_the_marks():
    assert typed_results(README.read_text("utf-8")) == []


@pytest.mark.parametrize("result", ["3.2 s", "3.8 % of the rays", "1.6 cm off", "0.36 GB", "3× as fast"])
def test_a_result_is_told_from_another_number(result):
    assert typed_results(f"PacketMesh {result}.") == [f"PacketMesh {result}."]
    assert typed_results(f"{BEGIN}\n{result}\n{END}\nPython 3.11 to 3.13, port 8080, 3-D, a 4×4 matrix") == []


def test_the_readme_is_two_screens_long():
    assert len(README.read_text("utf-8").splitlines()) <= 110


@pytest.mark.parametrize("path", [README, USING, ROOT / "docs" / "results.md"], ids=lambda path: path.name)
def test_links_lead_to_files(path):
    links = re.findall(r"\]\((?!https?://)([^)#]+)", path.read_text("utf-8"))
    assert links
    assert [link for link in links if not (path.parent / link).exists()] == []


PAGES = [README, ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


def anchors(path):
    """The names by which headings of a page can be linked."""
    found = set()
    for heading in re.findall(r"^#{1,4} (.+)$", FENCED.sub("", path.read_text("utf-8")), re.MULTILINE):
        name = again = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        times = 0
        while again in found:
            again = f"{name}-{(times := times + 1)}"
        found.add(again)
    return found


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_anchors_lead_to_headings(path):
    links = re.findall(r"\]\(([^)#:\s]*\.md|)#([^)\s]+)\)", FENCED.sub("", path.read_text("utf-8")))
    targets = [((path.parent / page) if page else path, anchor) for page, anchor in links]
    assert links or path != README
    assert [(page.name, anchor) for page, anchor in targets if anchor not in anchors(page)] == []


@pytest.mark.parametrize("path", [README, USING], ids=lambda path: path.name)
def test_commands_and_their_options_exist(path, capsys):
    lines = [line for line in "".join(blocks(path, "sh")).splitlines() if line.startswith("packetmesh")]
    assert lines
    for line in lines:
        _, command, *words = line.split("#")[0].split()
        with pytest.raises(SystemExit):
            main([command, "--help"])
        options = {word for word in words if word.startswith("--")}
        assert options <= set(re.findall(r"--[a-z][a-z-]*", capsys.readouterr().out)), line


def test_the_python_of_the_readme_runs(tmp_path):
    (code,) = blocks(README, "python")
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    before, after = (float(share) for share in re.findall(r"([\d.]+)%", done.stdout))
    assert after < before
    assert (tmp_path / "box.glb").stat().st_size > 100_000
