"""The path tracing engine: the only file that selects a Mitsuba variant.

With LLVM 15 to 18, Dr.Jit loads but aborts the whole process at its first real kernel, which cannot be caught. So each
candidate renders a few pixels in a subprocess, and only one that succeeds is used. A success is cached in the user's
cache folder: only the first command on a machine pays for it.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.core.machine import python_environment

T = TypeVar("T")
LLVM_OLDEST = 19  # Dr.Jit refuses 14 and aborts with 15 to 18
# Dr.Jit's threads flush denormal numbers to zero. A single one is the caller's, which keeps them: other bits. So may be
# what one block of work computes, if nothing waits before it.
LEAST_THREADS = 2
LIBRARY_VARIABLE = "DRJIT_LIBLLVM_PATH"
VARIANT_VARIABLE = "LAMBENT_VARIANT"
VARIANTS = ("cuda_ad_rgb", "llvm_ad_rgb")
PROBE_SECONDS = 300  # the first OptiX start compiles for a minute or more with some drivers
MEND = (
    "install LLVM 19 or newer (Debian and Ubuntu: apt-get install libllvm19; macOS: brew install llvm), "
    f"or set {LIBRARY_VARIABLE} to its library"
)

_PROBE = """
import json, sys
import drjit as dr
import mitsuba as mi
mi.set_variant(sys.argv[1])
mi.file_resolver().clear()
mi.file_resolver().append(mi.__path__[0])
scene = mi.cornell_box()
scene["sensor"]["film"]["width"] = scene["sensor"]["film"]["height"] = 4
image = mi.render(mi.load_dict(scene), spp=1)
dr.eval(image)
total = float(dr.sum(image.array)[0])
if not 0 < total < 1e6:
    raise SystemExit(f"rendered a sum of {total}")
llvm = dr.detail.llvm_version() if sys.argv[1].startswith("llvm") else None
print("lambent-probe " + json.dumps({"llvm_version": llvm and ".".join(map(str, llvm)), "threads": dr.thread_count()}))
"""


@dataclass(frozen=True)
class Engine:
    """A variant that has rendered on this machine. `llvm_library` is None if Dr.Jit finds LLVM itself."""

    variant: str
    llvm_version: str | None
    threads: int
    llvm_library: str | None = None


@dataclass(frozen=True)
class EngineProbe:
    """Result of the search: `engine` is None if nothing renders; `failures` has a reason per attempt."""

    engine: Engine | None
    failures: tuple[str, ...]
    cached: bool = False


@functools.cache
def engine() -> Engine:
    """Select and set the Mitsuba variant: CUDA if it renders, else LLVM. Further calls cost nothing.

    The environment variable LAMBENT_VARIANT forces one variant.

    Raises
    ------
    UserError
        If neither renders, with a hint on what to install.
    """
    probe = probe_engine()
    if probe.engine is None:
        raise UserError(f"no path tracing engine works here ({'; '.join(probe.failures)})", hint=MEND)
    chosen = probe.engine
    if chosen.llvm_library is not None:
        os.environ[LIBRARY_VARIABLE] = chosen.llvm_library
    os.environ.update(_kernel_cache_without_home())

    import mitsuba as mi

    if mi.variant() != chosen.variant:
        mi.set_variant(chosen.variant)
    _leave_current_folder(mi.file_resolver(), mi.__path__[0])
    import drjit as dr

    # To find loop invariants, Dr.Jit traces a loop twice, and a nested one four times; our kernels gain nothing from
    # it.
    dr.set_flag(dr.JitFlag.OptimizeLoops, False)
    set_threads(dr.thread_count())
    return chosen


def _leave_current_folder(resolver: Any, package: str) -> None:
    """Keep Mitsuba from the plugins of the current folder, which may be one that came with a scene.

    It finds its own elsewhere, but looks there for those that Lambent registers.
    """
    resolver.clear()
    resolver.append(package)
    for file in Path("plugins").glob("lambent_*"):
        raise UserError("would be loaded by Mitsuba", file=file.absolute(), hint="start Lambent in another folder")


def set_threads(count: int) -> None:
    """Set the number of Dr.Jit's threads, LEAST_THREADS or more."""
    import drjit as dr

    if dr.thread_count() != max(count, LEAST_THREADS):
        dr.set_thread_count(max(count, LEAST_THREADS))


def once_per_variant(make: Callable[[], T]) -> Callable[[], T]:
    """Cache a function per variant, for example one that defines a class derived from the variant's own."""
    made = functools.cache(lambda variant: make())
    return functools.wraps(make)(lambda: made(engine().variant))


def probe_engine() -> EngineProbe:
    """Search for an engine without setting it or raising, for `lambent doctor`."""
    names = _wanted_variants()
    library = find_llvm()
    key = _cache_key(names, library)
    cached = _read_cache(key)
    if cached is not None:
        return EngineProbe(cached, (), cached=True)
    failures: list[str] = []
    for name in names:
        found = _try(name, library if name.startswith("llvm") else None)
        if isinstance(found, Engine):
            _write_cache(key, found)
            return EngineProbe(found, tuple(failures))
        failures.append(f"{name}: {found}")
    return EngineProbe(None, tuple(failures))


def find_llvm() -> Path | None:
    """The LLVM library: the user's DRJIT_LIBLLVM_PATH, else the oldest in the usual places that is new enough.

    Dr.Jit is tested with the oldest; a newer version may have changed its C interface.
    """
    named = os.environ.get(LIBRARY_VARIABLE)
    if named:
        return Path(named)
    numbered = [(number, path) for path in _llvm_files() if (number := _llvm_number(path)) >= LLVM_OLDEST]
    return min(numbered)[1] if numbered else None


def _llvm_files() -> Iterator[Path]:
    for pattern in (
        "usr/lib/*-linux-gnu/libLLVM*.so*", "usr/lib/llvm-*/lib/libLLVM*.so*", "usr/lib/llvm*/lib64/libLLVM*.so*",
        "usr/lib64/libLLVM*.so*", "usr/lib64/llvm*/lib*/libLLVM*.so*", "usr/local/lib/libLLVM*.so*",
        "opt/homebrew/opt/llvm*/lib/libLLVM*.dylib", "usr/local/opt/llvm*/lib/libLLVM*.dylib",
    ):  # fmt: skip
        yield from sorted(Path("/").glob(pattern))


def _llvm_number(path: Path) -> int:
    """Major version from the resolved file name (libLLVM-19.so, libLLVM.so.19.1) or its folder (llvm-19, llvm@19)."""
    for text in (path.name, path.resolve().name, str(path.parent), str(path.resolve().parent)):
        found = re.search(r"(?:llvm[-@/]?|\.so\.)(\d+)", text, flags=re.IGNORECASE)
        if found:
            return int(found[1])
    return 0


def _wanted_variants() -> tuple[str, ...]:
    wanted = os.environ.get(VARIANT_VARIABLE)
    return (wanted,) if wanted else VARIANTS


def cuda_library() -> ctypes.CDLL | None:
    """The library of the CUDA driver; None without one."""
    try:
        return ctypes.CDLL("nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1")
    except OSError:
        return None


@functools.cache
def _cuda_driver() -> int | None:
    """Version number of the CUDA driver; None without one, which saves a probe that would fail."""
    library, number = cuda_library(), ctypes.c_int()
    try:
        return number.value if library and library.cuDriverGetVersion(ctypes.byref(number)) == 0 else None
    except AttributeError:
        return None


def _try(name: str, library: Path | None) -> Engine | str:
    """Render a few pixels with variant `name` in a subprocess; returns the engine, or a line with the reason."""
    if name.startswith("cuda") and _cuda_driver() is None:
        return "no CUDA driver"
    environment = python_environment() | _kernel_cache_without_home()
    if library is not None:
        environment[LIBRARY_VARIABLE] = str(library)
    try:
        command = [sys.executable, "-c", _PROBE, name]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PROBE_SECONDS)
    except subprocess.TimeoutExpired:
        return f"did not render within {PROBE_SECONDS} s"
    except OSError as error:
        return f"cannot start a probe ({error.strerror})"
    answer = next((line for line in done.stdout.splitlines() if line.startswith("lambent-probe ")), None)
    if done.returncode != 0 or answer is None:
        return _reason(done.returncode, done.stderr, library)
    facts = json.loads(answer.removeprefix("lambent-probe "))
    return Engine(name, facts["llvm_version"], facts["threads"], str(library) if library is not None else None)


def _reason(code: int, stderr: str, library: Path | None) -> str:
    lines = [line.strip() for line in stderr.splitlines() if line.strip()]
    with_library = f" with {library}" if library is not None else ""
    if code < 0:
        return f"aborted by signal {-code}{with_library} (LLVM older than {LLVM_OLDEST} does that)"
    return (lines[-1][:300] if lines else f"exit code {code}") + with_library


def _cache_key(names: tuple[str, ...], library: Path | None) -> str:
    """Hash of everything that affects the result: Mitsuba, LLVM, driver, graphics card."""
    stamp = library.stat().st_mtime_ns if library is not None and library.exists() else None
    cards = sorted(path.name for path in Path("/dev").glob("nvidia[0-9]*"))
    facts: list[object] = [names, version("mitsuba"), version("drjit"), sys.executable, str(library), stamp]
    facts += [_cuda_driver(), cards, os.environ.get("CUDA_VISIBLE_DEVICES"), os.cpu_count()]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def _cache_file() -> Path | None:
    """Cache file for successful probes; None for an account without a home."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA")
    elif sys.platform == "darwin":
        base = str(Path("~/Library/Caches").expanduser())
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path("~/.cache").expanduser())
    return Path(base) / "lambent" / "engine.json" if base and not base.startswith("~") else None


def _read_cache(key: str) -> Engine | None:
    """The cached engine; None if there is none, or the file is unreadable or malformed."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        if file := _cache_file():
            kept = json.loads(file.read_text(encoding="utf-8"))
            return Engine(**kept["engine"]) if kept["key"] == key else None
    return None


def _write_cache(key: str, found: Engine) -> None:
    with suppress(UserError):  # a home that is full or read-only only costs the probe's seconds every time
        if file := _cache_file():
            write_text(file, json.dumps({"key": key, "engine": asdict(found)}))


def _kernel_cache_without_home() -> dict[str, str]:
    """Environment variable with a folder for compiled kernels if HOME is missing, without which Dr.Jit aborts."""
    if sys.platform == "win32" or "HOME" in os.environ or "DRJIT_CACHE_DIR" in os.environ:
        return {}
    return {"DRJIT_CACHE_DIR": str(Path(tempfile.gettempdir()) / f"drjit-{os.getuid()}")}
