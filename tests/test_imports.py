"""The rules of docs/architecture.md: who imports whom, what loads quickly, how long a file is."""

from __future__ import annotations

import ast
import fnmatch
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "lambent"
MODULES = sorted(PACKAGE.rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("*.py"))

# A room may import rooms of a lower floor, and itself.
FLOOR = {
    "core": 0, "materials": 1, "scenes": 2, "store": 3, "baked": 3.5, "baking": 4, "realtime": 4, "editing": 4,
    "traced": 5, "viewer": 6, "render": 7, "published": 7, "site": 7.5, "report": 8, "bench": 8, "demo": 8, "api": 8.5,
    "cli": 9,
}  # fmt: skip
# Libraries that only some rooms may import.
ONLY_IN = {
    "mitsuba": {"baking", "published"},
    "drjit": {"baking", "published"},
    "pyoidn": {"baking"},
    "xatlas": {"baking"},
    "wgpu": {"realtime", "viewer"},
    "rendercanvas": {"realtime", "viewer"},
    "imgui_bundle": {"viewer"},
    "glfw": {"viewer"},
    "typer": {"cli"},
    "rich": {"api"},
    "ipywidgets": {"viewer"},
    "jupyter_rfb": {"viewer"},
    "zarr": {"store"},
    "numcodecs": {"store"},
    "numba": {"core", "baked", "baking", "editing"},
    "distributed": {"baking"},
}
HEAVY = {
    "mitsuba", "drjit", "wgpu", "rendercanvas", "imgui_bundle", "scipy", "matplotlib", "skimage", "trimesh", "zarr",
    "PIL", "imageio", "OpenEXR", "colour", "xatlas", "pyoidn", "flip_evaluator", "numba", "distributed",
}  # fmt: skip
BANNED_NAMES = {"utils", "util", "helpers", "helper", "manager", "misc", "common", "tools"}
LONGEST, LONGEST_TEST = 400, 500  # lines


def room_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).parts
    return parts[0] if len(parts) > 1 else ""


@cache
def imports_of(path: Path) -> list[tuple[int, str]]:
    """(line, absolute module name) of every import in a file, those inside functions included."""
    package, found = path.relative_to(ROOT).parts[:-1], []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (base, node.module) if part)
            found += [(node.lineno, f"{module}.{alias.name}") for alias in node.names]
    return found


def identifier(path: Path) -> str:
    return str(path.relative_to(ROOT))


def test_imports_go_downstairs() -> None:
    climbing = []
    for path in MODULES:
        room = room_of(path)
        for line, name in imports_of(path):
            top, *rest = name.split(".")
            where = f"{identifier(path)}:{line} imports {name}"
            if room not in ONLY_IN.get(top, {room}):
                climbing.append(f"{where}: only {sorted(ONLY_IN[top])} may")
            if top == "lambent" and rest and rest[0] in FLOOR and room and rest[0] != room:
                climbing += [where] if FLOOR[rest[0]] >= FLOOR[room] else []
    assert not climbing, "\n".join(climbing)


def _packages(module: str) -> list[str]:
    """The packages that hold a module, which run before it."""
    parts = module.split(".")
    return [".".join(parts[:n]) for n in range(1, len(parts))]


def module_graph() -> dict[str, set[str]]:
    """Module -> modules of the package that it imports, anywhere in its file, for types or in functions.

    Packages that hold an imported module are imported with it. Those that hold the module itself are left out: Python
    imports them before it.
    """
    names = {".".join(path.with_suffix("").relative_to(ROOT).parts).removesuffix(".__init__"): path for path in MODULES}
    graph = {}
    for name, path in names.items():
        # "package.module.attribute" imports the module, "package.module" itself
        wanted = [(one, one.rpartition(".")[0]) for _, one in imports_of(path)]
        found = {next((module for module in pair if module in names), name) for pair in wanted}
        found |= {package for module in found for package in _packages(module)}
        graph[name] = {module for module in found if not f"{name}.".startswith(f"{module}.")}
    return graph


def test_only_benches_import_published_methods() -> None:
    importers = {room_of(path) for path in MODULES for _, name in imports_of(path) if "lambent.published" in name}
    assert importers == {"bench"}


def test_no_modules_import_each_other() -> None:
    graph, circling = module_graph(), set()
    for module in graph:
        reached, ahead = set(), [module]
        while ahead:
            new = graph[ahead.pop()] - reached
            reached |= new
            ahead += new
        circling |= {module} & reached
    assert not circling


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
    names = [".".join(path.with_suffix("").relative_to(ROOT).parts) for path in (PACKAGE / room).rglob("*.py")]
    code = "\n".join(f"import {name.removesuffix('.__init__')}" for name in sorted(names))
    assert not modules_after(code) & {"mitsuba", "drjit", "wgpu", "imgui_bundle", "matplotlib"}


def test_files_are_short() -> None:
    long = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in (*MODULES, *TESTS, ROOT / "run.py")}
    assert not [identifier(path) for path in MODULES if long[path] > LONGEST]
    assert not [identifier(path) for path, lines in long.items() if lines > LONGEST_TEST]


def test_module_names_say_what_they_hold() -> None:
    assert not [identifier(path) for path in MODULES if path.stem in BANNED_NAMES]


def test_every_data_file_is_packaged() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = settings["tool"]["setuptools"]["package-data"]["lambent"]
    data = [p.name for p in PACKAGE.rglob("*") if p.is_file() and p.suffix != ".py" and p.parent.name != "__pycache__"]
    assert not [name for name in data if not any(fnmatch.fnmatch(name, p.rpartition("/")[2]) for p in patterns)]


def dependencies() -> tuple[dict[str, str], dict[str, str]]:
    """Distribution -> module, of what the package needs, extras included, and of what its tests need besides."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    optional = project["optional-dependencies"]
    module_of = {"pillow": "PIL", "colour-science": "colour"}

    def modules(names: list[str]) -> dict[str, str]:
        own = [name for name in names if not name.startswith("lambent[")]
        return {name: module_of.get(name, name.replace("-", "_")) for name in own}

    parts = (optional[extra] for extra in ("bake", "walk", "cluster", "notebook"))
    return modules(project["dependencies"] + [name for part in parts for name in part]), modules(optional["test"])


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
    comes_along = {"drjit", "llvmlite", "IPython"}  # with mitsuba, with numba, with the kernel of a notebook
    beside = {"bpy", "addon_utils", "lambent_blender"}  # installed by run.py, and by the wheel
    by_others = {"jupyter_rfb"}  # rendercanvas imports it
    assert third_party(MODULES) | by_others == set(needed.values()) | comes_along
    of_tests = third_party(TESTS) - {path.stem for path in TESTS} - beside
    assert of_tests <= set((needed | for_tests).values()) | comes_along
