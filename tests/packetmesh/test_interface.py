"""The public interface: every name loads, its example runs, and importing it imports nothing heavy."""

import ast
import doctest
import importlib
import re
import subprocess
import sys
import types
from pathlib import Path

import pytest

import packetmesh as pm
from tests.paths import ROOT

FUNCTIONS = [name for name in pm.__all__ if isinstance(getattr(pm, name), types.FunctionType)]


def typed_imports() -> dict[str, object]:
    """What a type checker sees: each name of the ``if TYPE_CHECKING`` block, and the object it stands for."""
    tree = ast.parse(Path(pm.__file__).read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    return {
        alias.asname or alias.name: getattr(importlib.import_module(line.module), alias.name)
        for line in block.body
        for alias in line.names
    }


def test_what_a_type_checker_sees_is_what_is_loaded():
    typed = typed_imports()
    assert sorted(typed) == sorted(pm.__all__) == sorted(dir(pm))
    for name, seen in typed.items():
        assert getattr(pm, name) is seen, name


def test_an_unknown_name_is_an_attribute_error_that_names_it():
    with pytest.raises(AttributeError, match="reconstruckt"):
        pm.reconstruckt  # noqa: B018


@pytest.mark.parametrize("use", ["dir(pm)", "pm.InputError, pm.Progress, pm.drain", "pm.with_settings"])
def test_importing_it_and_its_light_names_imports_nothing_heavy(use):
    script = f"import sys; import packetmesh as pm; {use}; print(*sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {module.partition(".")[0] for module in done.stdout.split()}
    assert "packetmesh" in loaded
    assert not loaded & {"numpy", "scipy", "open3d", "cv2", "numba", "simpy", "pipeline", "network_sim"}


def test_a_name_imports_only_its_own_side():
    script = "import sys; import packetmesh as pm; pm.simulate; print(*sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {module.partition(".")[0] for module in done.stdout.split()}
    assert "network_sim" in loaded
    assert not loaded & {"open3d", "pipeline"}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_has_an_example_that_gives_what_it_shows(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert examples_of(name)
    failures: list[str] = []
    for example in examples_of(name):
        doctest.DocTestRunner().run(example, out=failures.append)
    assert not failures, "".join(failures)


def examples_of(name: str) -> list[doctest.DocTest]:
    """The examples in the docstring of a public function; they know no name but what they import."""
    found = doctest.DocTestFinder(recurse=False).find(getattr(pm, name), name, globs={})
    return [example for example in found if example.examples]


def test_the_site_has_every_public_name_once():
    text = (ROOT / "docs" / "interface.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^### pm\.(\w+)$", text, re.MULTILINE)) == sorted(pm.__all__)
    for name in pm.__all__:
        module, attribute = pm._PLACES[name]
        assert f":: {module}.{attribute}\n" in text
