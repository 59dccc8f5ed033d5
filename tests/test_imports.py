"""The plan of the house (docs/architecture.md), walked: who imports whom, what is quick, how long a file is."""

from __future__ import annotations

import ast
import fnmatch
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "lambent"
MODULES = sorted(PACKAGE.rglob("*.py"))

# A room may import rooms of a lower floor, and itself.
FLOOR = {
    "core": 0, "materials": 1, "scenes": 2, "store": 3, "bake": 4, "realtime": 4, "editing": 4, "viewer": 5,
    "report": 6, "bench": 6, "demo": 6, "cli": 7,
}  # fmt: skip
# Libraries that only some rooms may import.
ONLY_IN = {
    "mitsuba": {"bake"},
    "drjit": {"bake"},
    "pyoidn": {"bake"},
    "xatlas": {"bake"},
    "wgpu": {"realtime", "editing", "viewer"},
    "rendercanvas": {"realtime", "editing", "viewer"},
    "imgui_bundle": {"viewer"},
    "glfw": {"viewer"},
    "typer": {"cli"},
    "rich": {"cli"},
    "zarr": {"store"},
    "numcodecs": {"store"},
}
HEAVY = {
    "mitsuba", "drjit", "wgpu", "rendercanvas", "imgui_bundle", "scipy", "matplotlib", "skimage", "trimesh", "zarr",
    "PIL", "imageio", "OpenEXR", "colour", "xatlas", "pyoidn", "flip_evaluator", "numba",
}  # fmt: skip
BANNED_NAMES = {"utils", "util", "helpers", "helper", "manager", "misc", "common", "tools"}
# Modules of a room that import each other and are still to be separated.
KNOWN_CIRCLES = {frozenset({"lambent.viewer.panels.recording", "lambent.viewer.panels.scene"})}
LONGEST = 500


def room_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).parts
    return parts[0] if len(parts) > 1 else ""


def imports_of(path: Path, *, for_types: bool = True) -> Iterator[tuple[int, str]]:
    """(line, absolute module name) of every import in a file, also in functions and, `for_types`, for type checkers."""
    package = path.relative_to(ROOT).parts[:-1]
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in [] if for_types else list(ast.walk(tree)):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = [ast.Pass()]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (base, node.module) if part)
            yield from ((node.lineno, f"{module}.{alias.name}") for alias in node.names)


def name_of(path: Path) -> str:
    """The module's name, such as lambent.core.errors."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def identifier(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", MODULES, ids=identifier)
def test_imports_go_downstairs(path: Path) -> None:
    room = room_of(path)
    for line, name in imports_of(path):
        top, *rest = name.split(".")
        where = f"{identifier(path)}:{line} imports {name}"
        if top in ONLY_IN:
            assert room in ONLY_IN[top], f"{where}: only {sorted(ONLY_IN[top])} may"
        if top == "lambent" and rest and rest[0] in FLOOR and room and rest[0] != room:
            assert FLOOR[rest[0]] < FLOOR[room], where


def test_no_circles_inside_rooms() -> None:
    """Imports inside functions count. A circle that is gone leaves KNOWN_CIRCLES."""
    names = {name_of(path): path for path in MODULES if room_of(path)}
    numbers = {name: number for number, name in enumerate(names)}
    imports = np.zeros((len(names), len(names)), dtype=bool)
    for name, path in names.items():
        for _, target in imports_of(path, for_types=False):
            module = target if target in names else target.rpartition(".")[0]
            if module in names and module != name:
                imports[numbers[name], numbers[module]] = True
    _, circle_of = connected_components(imports, directed=True, connection="strong")
    circles = [[name for name in names if circle_of[numbers[name]] == circle] for circle in np.unique(circle_of)]
    assert {frozenset(circle) for circle in circles if len(circle) > 1} == KNOWN_CIRCLES


def test_every_room_has_a_floor() -> None:
    assert {room_of(path) for path in MODULES} - {""} <= set(FLOOR)


def modules_after(code: str) -> set[str]:
    program = f"{code}\nimport sys\nprint(' '.join({{name.partition('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_the_package_is_quick() -> None:
    assert not modules_after("import lambent") & HEAVY


def test_the_command_line_starts_without_anything_heavy() -> None:
    loaded = modules_after("from lambent.cli.main import build_app; build_app()")
    assert not loaded & (HEAVY | {"numpy", "pydantic"})


@pytest.mark.parametrize("room", ["core", "materials", "scenes", "store"])
def test_lower_floors_load_no_engine(room: str) -> None:
    code = "\n".join(f"import {name_of(path)}" for path in sorted((PACKAGE / room).rglob("*.py")))
    assert not modules_after(code) & {"mitsuba", "drjit", "wgpu", "imgui_bundle", "matplotlib"}


@pytest.mark.parametrize("path", [*MODULES, *sorted((ROOT / "tests").rglob("*.py")), ROOT / "run.py"], ids=identifier)
def test_files_are_short(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= LONGEST


def test_module_names_say_what_they_hold() -> None:
    assert not [identifier(path) for path in MODULES if path.stem in BANNED_NAMES]


def test_every_data_file_is_packaged() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = settings["tool"]["setuptools"]["package-data"]["lambent"]
    data = [p.name for p in PACKAGE.rglob("*") if p.is_file() and p.suffix not in (".py", ".pyc")]
    assert not [name for name in data if not any(fnmatch.fnmatch(name, p.rpartition("/")[2]) for p in patterns)]


def dependencies() -> tuple[dict[str, str], dict[str, str]]:
    """Distribution -> module, of what the package needs and of what its tests need besides."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    module_of = {"pillow": "PIL", "colour-science": "colour"}

    def modules(names: list[str]) -> dict[str, str]:
        return {name: module_of.get(name, name.replace("-", "_")) for name in names}

    return modules(project["dependencies"]), modules(project["optional-dependencies"]["test"])


def third_party(paths: list[Path]) -> set[str]:
    names = {name.partition(".")[0] for path in paths for _, name in imports_of(path)}
    return names - set(sys.stdlib_module_names) - {"__future__", "lambent", "tests", "conftest"}


def test_every_dependency_is_pinned() -> None:
    pinned = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert all(line.count("==") == 1 for line in pinned)
    needed, for_tests = dependencies()
    assert {name.lower() for name in needed | for_tests} <= {line.partition("==")[0].lower() for line in pinned}


def test_every_dependency_is_used_and_every_import_is_a_dependency() -> None:
    needed, for_tests = dependencies()
    comes_along = {"drjit"}  # with mitsuba
    assert third_party(MODULES) == set(needed.values()) | comes_along
    in_tests = third_party(sorted((ROOT / "tests").rglob("*.py")))
    local = {path.stem for path in (ROOT / "tests").rglob("*.py")}
    assert in_tests - local <= set((needed | for_tests).values()) | comes_along
