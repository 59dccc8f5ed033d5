"""Switches of bench `ablation`: constants and special cases with their neutral values, and how one is set.

A place is a dotted name of a module's constant or function, or of an attribute or an item below it; or FILE.wgsl:NAME,
a `const`, an `override` or a function of a shader. Several places with one neutral value are separated by spaces. A
neutral function of Python replaces a function, and is applied to any other value. A neutral text of WGSL replaces a
function's body.
"""

from __future__ import annotations

import ast
import importlib
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import lambent
from lambent.core.errors import UserError

DRAW, TRACE, BAKE = "draw", "trace", "bake"
ASSEMBLE = "lambent.realtime.gpu.shader_source.assemble"


@dataclass(frozen=True)
class Switch:
    """Places, their neutral value, and where they act: in frames, in traced pictures, or in bakes (and in both)."""

    place: str
    neutral: Any
    when: str = DRAW

    def __str__(self) -> str:
        value = getattr(self.neutral, "__name__", self.neutral)
        return f"{self.place.replace('lambent.', '')} = {value}"


def nothing(*_given: Any) -> None:
    """A function's neutral value."""


# Each gains .001 FLIP, .02 of the worst tile or 5 % of a frame's time in one of five scenes; `takes_lamps` gains 7 dB
# in bench `quality`.
SWITCHES = (
    Switch("lambent.realtime.planar.planar_integrators.PLANAR.lamps", None),
    Switch("lambent.realtime.objects.draws.takes_lamps", nothing),
    Switch("shade.wgsl:with_shares", "    return found;"),
    Switch("surface.wgsl:in_niche", "    return found;"),
    Switch("lambent.realtime.incident.planes.PREFERENCE", -1),
    Switch("lambent.realtime.incident.distance.PREFERENCE", -1),
    Switch("lambent.realtime.planar.planar_view._plan", nothing),
    Switch("lambent.realtime.planar.planar_view.MOST_REFLECTORS", 1),
    Switch("lambent.realtime.planar.reflector_faces.MOST_FACES", 0),
    Switch("lambent.realtime.objects.draws.BLURS_M", 1e9),
    Switch("planar_interleaved.wgsl:LEAST_PX", 1e9),
    Switch("planar_march.wgsl:hit_behind", "    return Hit(place.q + free * w, free, vec4f(0.0), vec2f(0.0), 0.0);"),
)


@contextmanager
def switched(switch: Switch) -> Iterator[None]:
    """Set a switch to its neutral value, also where other modules have imported the name; caches start empty.

    Raises
    ------
    UserError
        If there is no such place.
    """
    with ExitStack() as undo:
        for place in switch.place.split():
            for holder, name, value, neutral in _changes(place, switch.neutral):
                undo.callback(_put, holder, name, value)
                _put(holder, name, neutral)
        yield


def _changes(place: str, neutral: Any) -> list[tuple[Any, str, Any, Any]]:
    """Holders of a place's value, its name there, the value, and the neutral one."""
    if ".wgsl:" in place:
        place, neutral = ASSEMBLE, _assembling(place, neutral)
    owner, name, value = _found(place)
    if callable(neutral) and not callable(value):
        neutral = neutral(value)
    holders = [owner]
    if isinstance(owner, ModuleType):
        holders = [module for module in _modules() if name in vars(module) and vars(module)[name] is value]
    return [(holder, name, value, neutral) for holder in holders]


def _put(holder: Any, name: str, value: Any) -> None:
    if isinstance(holder, Mapping):
        holder[name] = value  # type: ignore[index]
    elif isinstance(holder, type | ModuleType):
        setattr(holder, name, value)
        for function in vars(holder).values():
            if hasattr(function, "cache_clear"):
                function.cache_clear()
    else:
        object.__setattr__(holder, name, value)  # of frozen dataclasses, too


def _modules() -> list[ModuleType]:
    return [module for name, module in list(sys.modules.items()) if name.split(".")[0] == "lambent"]


def _found(place: str) -> tuple[Any, str, Any]:
    """What holds a place, its last name, and the present value."""
    *path, last = place.split(".")
    owner: Any = lambent
    for depth, name in enumerate(path[1:], 2):
        owner = _part(owner, name, ".".join(path[:depth]))
    return owner, last, _part(owner, last, place)


def _part(owner: Any, name: str, place: str) -> Any:
    if isinstance(owner, Mapping) and name in owner:
        return owner[name]
    if hasattr(owner, name):
        return getattr(owner, name)
    try:
        return importlib.import_module(place)
    except ModuleNotFoundError as error:
        raise UserError("no such constant or function", field="switch", got=place) from error


def _assembling(place: str, neutral: Any) -> Callable[..., str]:
    """`ASSEMBLE` with another value of a constant, or another body of a function, in a shader file."""
    file, name = place.split(":")
    path = next(Path(lambent.__path__[0]).rglob(file), None)
    text = path.read_text(encoding="utf-8") if path else ""
    constant = re.search(rf"^( *(?:const|override) {name}\b[^=\n]*= )([^;\n]+);.*$", text, re.MULTILINE)
    function = re.search(rf"^(fn {name}\([^{{]*\{{\n).*?^\}}", text, re.MULTILINE | re.DOTALL)
    if constant:
        old, new = constant[0], f"{constant[1]}{neutral};"
    elif function:
        old, new = function[0], f"{function[1]}{neutral}\n}}"
    else:
        raise UserError("no such constant or function", field="switch", got=place)
    assemble = _found(ASSEMBLE)[2]
    return lambda *names, **options: assemble(*names, **options).replace(old, new)


def is_frozen(switch: Switch) -> bool:
    """Whether no function reads a module's constant when it runs: its value is in defaults, tables or compiled code."""
    return any(_is_frozen(place) for place in switch.place.split() if ".wgsl:" not in place)


def _is_frozen(place: str) -> bool:
    owner, name, value = _found(place)
    if not isinstance(owner, ModuleType) or callable(value):
        return False
    for module in _modules():
        names, attributes = _read_by_functions(module)
        holds = name in vars(module) and vars(module)[name] is value
        if (name in names and holds) or (name in attributes and owner in vars(module).values()):
            return False
    return True


@cache
def _read_by_functions(module: ModuleType) -> tuple[set[str], set[str]]:
    """Names and attributes in a module's functions, without those that numba compiles."""
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8") if module.__file__ else "")
    functions = (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))
    run = (function for function in functions if not any("njit" in ast.dump(d) for d in function.decorator_list))
    nodes = [node for function in run for statement in function.body for node in ast.walk(statement)]
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    return names, {node.attr for node in nodes if isinstance(node, ast.Attribute)}
