"""The mutations of a module: one operator, number or condition changed at one place."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from heapq import nsmallest
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

GROUPS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "registration": (("pipeline/registration/*.py",), ("tests/pipeline/registration",)),
    "pivoting": (
        ("pipeline/surface/pivoting/*.py",),
        (
            "tests/pipeline/surface/test_ball_pivoting.py",
            "tests/pipeline/surface/test_pivoting_guarantees.py",
            "tests/pipeline/surface/test_pivoting_shapes.py",
        ),
    ),
    "depth": (("pipeline/depth/*.py",), ("tests/pipeline/depth",)),
    "calibration": (("pipeline/calibration/*.py",), ("tests/pipeline/calibration",)),
    "mac": (("network_sim/mac/*.py",), ("tests/network_sim/mac", "tests/network_sim/radio")),
    "delivery": (("pipeline/delivery/*.py",), ("tests/pipeline/delivery", "tests/pipeline/test_deliver.py")),
    "web": (
        ("app/web/entrance.py", "app/web/uploads.py", "app/web/upload_gate.py"),
        (
            "tests/app/web/test_entrance.py",
            "tests/app/web/test_uploads.py",
            "tests/bad_input/test_uploads.py",
        ),
    ),
}
"""By group: patterns of its modules, and paths of the tests that should see a fault in them."""
SKIPPED = (
    *("Bit", "Shift", "Mod", "Invert"),  # unlikely mistakes, and any test sees them
    *("RemoveDecorator", "ExceptionReplacer"),  # neither is part of a formula
)
"""Parts of the names of operators that are left out."""


@dataclass(frozen=True, slots=True)
class Mutation:
    """One fault at one place."""

    group: str
    path: str
    """Path of the module, relative to the repository."""
    operator: str
    """Name of Cosmic Ray's operator."""
    occurrence: int
    """Index among the places in the module that the operator can change."""
    line: int
    source: str
    """Text of the line, without its indentation."""

    @property
    def name(self) -> str:
        """Path, operator and occurrence; they denote the same fault as long as the module is unchanged."""
        return f"{self.path} {self.operator.partition('/')[2]} {self.occurrence}"

    @property
    def place(self) -> str:
        """Name and source line: after a change of the module, the same name can denote another fault."""
        return f"{self.name}: {self.source}"

    def applied(self, code: str) -> str:
        """Return the module's code with the fault."""
        mutated: str = mutate_code(code, get_operator(self.operator)(), self.occurrence)
        return mutated


def draw(root: Path, count: int, seed: int) -> list[Mutation]:
    """Return ``count`` of all groups' mutations, drawn with equal chances, in the order of drawing.

    Each has a number by chance, and those of the smallest numbers are drawn: where a module changes, only
    its own mutations are drawn anew.
    """
    everything = (one for group in GROUPS for one in mutations(root, group))
    return nsmallest(count, everything, key=lambda one: sha256(f"{seed} {one.place}".encode()).digest())


def mutations(root: Path, group: str) -> Iterator[Mutation]:
    """Yield all mutations of a group's modules except those on the lines of ``_annotation_lines``."""
    for pattern in GROUPS[group][0]:
        for path in sorted(root.glob(pattern)):
            code = path.read_text(encoding="utf-8")
            lines, untested = code.splitlines(), _annotation_lines(code)
            nodes = list(ast_nodes(get_ast(code)))
            for name in operator_names():
                operator = get_operator(name)
                if any(one in name for one in SKIPPED) or operator.arguments():
                    continue
                places = (place for node in nodes for place in operator().mutation_positions(node))
                for occurrence, (start, _) in enumerate(places):
                    if start[0] not in untested:
                        module, source = str(path.relative_to(root)), lines[start[0] - 1].strip()
                        yield Mutation(group, module, name, occurrence, start[0], source)


def _annotation_lines(code: str) -> set[int]:
    """Return the numbers of all lines with annotated arguments or return types, asserts or type checks."""
    lines = set[int]()
    for node in ast.walk(ast.parse(code)):
        spans = list[ast.AST | None]()
        if isinstance(node, ast.FunctionDef):
            spans += [arg.annotation for arg in node.args.args + node.args.kwonlyargs]
            spans.append(node.returns)
        elif isinstance(node, ast.Assert):
            spans = [node]
        elif isinstance(node, ast.If) and isinstance(node.test, ast.Name):
            spans = [node] if node.test.id == "TYPE_CHECKING" else []
        for span in spans:
            if span is not None:
                lines.update(range(span.lineno, (span.end_lineno or span.lineno) + 1))  # type: ignore[attr-defined]
    return lines
