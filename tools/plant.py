"""Plant random defects in the package and see which ones the tests of their room notice.

    .venv/bin/python tools/plant.py -n 200 --seed 1 --json planted.json
    .venv/bin/python tools/plant.py --at lambent/baked/answering/answer.py:303

A defect is a wrong sign, factor, index, bound, comparison or order of arguments, `min` for `max`, or one off. Each is
planted in a copy of the working tree, never in the checkout, and the tests of its room (`tests/<room>`) run there until
the first failure, those nearest to its file first. A failure counts if the same test passes without the defect.

mutmut 3 leaves decorated functions alone (every numba kernel and property), cosmic-ray has one test command for all
files, and neither knows WGSL.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

CAUGHT, SURVIVED, OUT_OF_TIME, UNSOUND = "caught", "survived", "out of time", "fails without"


def _both(*pairs: tuple[Any, Any]) -> dict[Any, Any]:
    return dict(pairs) | {new: old for old, new in pairs}


OPPOSITE = _both((ast.Add, ast.Sub), (ast.Mult, ast.Div))
REVERSED = _both((ast.Lt, ast.Gt), (ast.LtE, ast.GtE), (ast.Eq, ast.NotEq))
OFF_BY_ONE = _both((ast.Lt, ast.LtE), (ast.Gt, ast.GtE), (ast.Eq, ast.NotEq))
EXTREMES = _both(("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("any", "all"), ("floor", "ceil"))
# Calls whose exchanged arguments are the same, or an error of any run.
EITHER_WAY = {"dot", "hypot", "isclose", "allclose", "logical_and", "logical_or", "asarray"}
EITHER_WAY |= {"isinstance", "issubclass", "getattr", "setattr", "hasattr"}
SAID = {"print", "say", "warn", "warning", "note", "UserError", "TypeVar", "NewType", "echo"}
SPEED_ALONE = re.compile(r"CHUNK|BATCH|AT_ONCE|TIMEOUT|BYTES|stacklevel|indent|timeout|chunk|__all__")

SHADER_TOKENS = (
    EXTREMES | _both(("+", "-"), ("*", "/"), ("<", ">"), ("<=", ">="), ("==", "!="), ("x", "y")) | {"z": "x"}
)
SHADER_MASK = re.compile(
    r"//[^\n]*|/\*.*?\*/|@[^\n]*|\boverride\b[^\n]*|\b(?:array|vec\d|mat\dx\d|ptr|bitcast|var)<[^;{\n(]*>", re.DOTALL
)
SHADER_SITE = re.compile(
    r"(?<= )(?P<operator>[-+*/<>]|<=|>=|==)(?= )|\b(?P<extreme>min|max|floor|ceil)(?=\()"
    r"|(?<=[(=,])(?P<minus> ?-)(?=[\w(])|(?<=[\w)\]])\.(?P<part>[xyz])\b|(?<![\w.])(?P<factor>\d+\.\d+)\b"
    r"|(?<![\w.])(?P<integer>\d+)(?=[ui]?\b)(?!\.)"
    r"|\b(?:mix|cross|step|pow|atan2)\((?P<swap>[\w.]+, [\w.]+)(?=[,)])"
)


@dataclass(frozen=True)
class Defect:
    """A replacement of the bytes [begin, end) of a file by `new`."""

    file: str
    line: int
    begin: int
    end: int
    old: str
    new: str


def defects_of(file: str, text: str) -> list[Defect]:
    """Return the defects that can be planted in a Python file or a shader."""
    found = _in_shader(text) if file.endswith(".wgsl") else _in_python(text)
    data = text.encode()
    return [Defect(file, data.count(b"\n", 0, b) + 1, b, e, data[b:e].decode(), new) for b, e, new in found]


def _in_python(text: str) -> Iterator[tuple[int, int, str]]:
    starts = [0]
    for line in text.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node, new in _replacements(ast.parse(text)):
        code = ast.unparse(new)
        whole = isinstance(new, ast.Call | ast.Name | ast.Attribute | ast.Constant)
        begin = starts[node.lineno - 1] + node.col_offset
        yield begin, starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0), code if whole else f"({code})"


def _replacements(node: ast.AST) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield expressions and wrong ones, wherever a wrong one can change what the program does."""
    match node:
        case ast.Raise() | ast.JoinedStr() | ast.match_case() | ast.Assert():
            return
        case ast.Call(func=func) if _last(func) in SAID:
            return
        case ast.Assign(targets=[ast.Name(id=name)]) | ast.keyword(arg=str(name)) if SPEED_ALONE.search(name):
            return
    if isinstance(node, ast.expr):
        yield from ((node, new) for new in _wrong(node))
    for name, value in ast.iter_fields(node):
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, ast.AST) and name not in ("annotation", "returns", "decorator_list"):
                yield from _replacements(part)


def _wrong(node: ast.expr) -> Iterator[ast.expr]:
    match node:
        case ast.BinOp(left, op, right) if type(op) in OPPOSITE and "'" not in ast.unparse(node):
            yield ast.BinOp(left, OPPOSITE[type(op)](), right)
        case ast.UnaryOp(ast.USub(), operand):
            yield operand
        case ast.Compare(left, [op], [right]) if type(op) in REVERSED:
            counted = any(isinstance(side, ast.Constant | ast.Call) for side in (left, right))
            yield ast.Compare(left, [(OFF_BY_ONE if counted else REVERSED)[type(op)]()], [right])
        case ast.Constant(int(value)) if value is not True and value is not False:
            yield ast.Constant(value + 1)
        case ast.Constant(float(value)):
            yield ast.Constant(2 * value or 1.0)
        case ast.Name(name) if name in EXTREMES:
            yield ast.Name(EXTREMES[name])
        case ast.Attribute(of, name) if name in EXTREMES:
            yield ast.Attribute(of, EXTREMES[name])
        case ast.Call(func, [first, second, *rest], keywords) if _last(func) not in {*EITHER_WAY, *EXTREMES}:
            if all(isinstance(side, ast.Name | ast.Attribute | ast.Subscript) for side in (first, second)):
                yield ast.Call(func, [second, first, *rest], keywords)


def _last(func: ast.expr) -> str:
    return ast.unparse(func).rpartition(".")[2]


def _in_shader(text: str) -> Iterator[tuple[int, int, str]]:
    masked = SHADER_MASK.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)
    for match in SHADER_SITE.finditer(masked):
        kind = match.lastgroup or ""
        begin, end = (len(text[:at].encode()) for at in match.span(kind))
        yield begin, end, _wrong_token(kind, match[kind])


def _wrong_token(kind: str, old: str) -> str:
    if kind == "factor":
        return str(2 * float(old) or 1.0)
    if kind == "integer":
        return str(int(old) + 1)
    if kind == "swap":
        return ", ".join(reversed(old.split(", ")))
    return "" if kind == "minus" else SHADER_TOKENS[old]


def drawn(files: Sequence[str], root: Path, count: int, seed: int) -> list[Defect]:
    """Return random defects: of any file, of any of its lines, so that tables of numbers have no more than others."""
    rng = random.Random(seed)
    chosen: list[Defect] = []
    while len(chosen) < count:
        for file in rng.sample(files, min(count - len(chosen), len(files))):
            found = defects_of(file, (root / file).read_text())
            line = rng.choice(sorted({defect.line for defect in found} or {0}))
            chosen += rng.sample([defect for defect in found if defect.line == line], min(len(found), 1))
    return chosen


def tests_of(file: str, root: Path) -> list[str]:
    """Return a room's test files: those that name `file`, those that name a file that imports it, the others."""
    room = Path(file).parts[1]
    users = [user for user in (root / "lambent" / room).rglob("*.py") if _names(user.read_text(), Path(file))]
    ranks = {}
    for test in sorted((root / "tests" / room).rglob("test_*.py")):
        text = test.read_text()
        near = Path(file).stem in test.stem or _names(text, Path(file))
        ranks[str(test.relative_to(root))] = 2 - any(_names(text, user.relative_to(root)) for user in users) - 2 * near
    return sorted(ranks, key=lambda test: ranks[test])


def _names(text: str, file: Path) -> bool:
    """Whether a text imports a module, or has the name of a shader."""
    package, name = re.escape(".".join(file.parts[:-1])), re.escape(file.stem)
    imported = rf"\b{package}\.{name}\b|from {package} import [^\n]*\b{name}\b"
    return re.search(imported if file.suffix == ".py" else rf'"{name}(\.wgsl)?"', text) is not None


class Field:
    """A copy of the working tree, in which defects are planted one at a time."""

    def __init__(self, root: Path, folder: Path, limit: int) -> None:
        self._shared = os.environ.get("LAMBENT_SHARED", str(root.parent / "shared" / "data"))
        self._copy, self._kernels, self._limit, self._sound = folder / "copy", folder / "kernels", limit, set[str]()
        shutil.copytree(root, self._copy, ignore=shutil.ignore_patterns(".git", ".venv", ".*_cache", "__pycache__"))

    def judged(self, defect: Defect) -> tuple[str, str]:
        """Return the verdict of the tests, and the test that failed."""
        file, tests = self._copy / defect.file, tests_of(defect.file, self._copy)
        if not tests:
            return SURVIVED, ""
        before = file.read_bytes()
        try:
            self._write(file, before[: defect.begin] + defect.new.encode() + before[defect.end :])
            with tempfile.TemporaryDirectory() as fresh:  # numba's cache of a caller ignores changes of what it calls
                outcome, failed = self._run(tests, Path(fresh) if self._compiled(file) else self._kernels)
        finally:
            self._write(file, before)
        if outcome == CAUGHT and failed not in self._sound:
            if self._run([failed or tests[0]], self._kernels)[0] != SURVIVED:
                return UNSOUND, failed
            self._sound.add(failed)
        return outcome, failed

    def _compiled(self, file: Path) -> bool:
        """Whether numba compiles a function of a file, or one of a file that imports it."""
        texts = [path.read_text() for path in (self._copy / "lambent").rglob("*.py")]
        named = file.relative_to(self._copy)
        return "numba" in file.read_text() or any("numba" in text and _names(text, named) for text in texts)

    def _write(self, file: Path, data: bytes) -> None:
        """Write a file, and remove its compiled ones: their times, of whole seconds, do not tell two versions apart."""
        file.write_bytes(data)
        for compiled in (file.parent / "__pycache__").glob(f"{file.stem}.*.pyc"):
            compiled.unlink()

    def _run(self, tests: list[str], kernels: Path) -> tuple[str, str]:
        command = [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider", *tests]
        paths = {"PYTHONPATH": str(self._copy), "NUMBA_CACHE_DIR": str(kernels), "LAMBENT_SHARED": self._shared}
        run = subprocess.run(
            ["timeout", "-s", "KILL", str(20 * self._limit), *command], cwd=self._copy, env={**os.environ, **paths},
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (self._limit, self._limit)),
            capture_output=True, text=True,
        )  # fmt: skip
        failed = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", run.stdout, re.MULTILINE)
        verdict = {0: SURVIVED, 1: CAUGHT, 2: CAUGHT, 5: SURVIVED}.get(run.returncode, OUT_OF_TIME)
        return verdict, failed[1] if failed else ""


def main() -> None:
    """Plant what the command line asks for."""
    parser = argparse.ArgumentParser(description="Plant random defects, and see which ones tests of their room notice.")
    parser.add_argument("-n", type=int, default=200, help="number of defects")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="lambent", help="folder or file, as lambent/core")
    parser.add_argument("--at", nargs="+", default=[], metavar="FILE:LINE", help="every defect of these lines instead")
    parser.add_argument("--limit", type=int, default=600, help="CPU seconds of tests for each defect")
    parser.add_argument("--json", type=Path, help="file for the results, written after each defect")
    options = parser.parse_args()
    root = Path(__file__).parents[1]
    files = [str(path.relative_to(root)) for path in sorted((root / options.only).parent.rglob("*"))]
    files = [f for f in files if f.startswith(options.only) and f.endswith((".py", ".wgsl")) and f.count("/") > 1]
    chosen = [] if options.at else drawn(files, root, options.n, options.seed)
    for file, line in (at.rsplit(":", 1) for at in options.at):
        chosen += [defect for defect in defects_of(file, (root / file).read_text()) if defect.line == int(line)]
    rows: list[dict[str, str]] = []
    with tempfile.TemporaryDirectory() as folder:
        field = Field(root, Path(folder), options.limit)
        for defect in chosen:
            verdict, test = field.judged(defect)
            rows.append({**asdict(defect), "room": defect.file.split("/")[1], "verdict": verdict, "test": test})
            print(f"{verdict:12} {defect.file}:{defect.line}  {defect.old!r} -> {defect.new!r}  {test}", flush=True)
            if options.json:
                options.json.write_text(json.dumps(rows, indent=1))
    planted = Counter(row["room"] for row in rows)
    caught = Counter(row["room"] for row in rows if row["verdict"] == CAUGHT)
    print(*(f"{room:12} {caught[room]} of {planted[room]}" for room in sorted(planted)), sep="\n")
    print(f"{'all':12} {caught.total()} of {planted.total()}")


if __name__ == "__main__":
    main()
