"""The house: what lies at the top of each package, how long files are, and that no imports go in a circle."""

import ast
from graphlib import TopologicalSorter

import grimp
import pytest

from tests.paths import ROOT

PACKAGES = ("packetmesh", "network_sim", "pipeline", "lab", "app")
MOST_LINES = 400


def modules(package: str) -> list[str]:
    """Names of the modules that lie directly in a package."""
    return sorted(path.stem for path in (ROOT / package).glob("*.py") if path.stem != "__init__")


def test_no_imports_go_in_a_circle_those_for_types_alone_included():
    graph = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=False)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    assert len(imports) > 500
    TopologicalSorter(imports).prepare()  # raises CycleError, which names the circle


def test_only_the_story_lies_at_the_top_of_each_package():
    assert len(modules("app")) <= 8
    assert modules("pipeline") == sorted(
        [
            "types",
            "quality",
            "config",
            "spec",
            "sources",
            "stages",
            "nodes",
            "merging",
            "reconstruct",
            "deliver",
        ]
    )
    assert modules("network_sim") == sorted(["config", "presets", "types", "simulate", "replicate"])


@pytest.mark.parametrize("package", PACKAGES)
def test_every_folder_says_what_it_holds_and_no_file_is_long(package):
    for path in (ROOT / package).rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert len(text.splitlines()) <= MOST_LINES, path
        assert ast.get_docstring(ast.parse(text)), path
