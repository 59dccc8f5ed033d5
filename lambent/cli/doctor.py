"""`lambent doctor`: what of this machine Lambent can use, what is missing, and the one command that mends it."""

from __future__ import annotations

import json as jsonlib
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass

import typer

from lambent.cli.console import Json, show, table

MEMORY_NEEDED_GB = 4
PROBE_SECONDS = 120

# Package manager -> how it installs. The first one found is the one the command is for.
MANAGERS = {
    "apt-get": "apt-get install -y",
    "dnf": "dnf install -y",
    "pacman": "pacman -S --needed --noconfirm",
    "brew": "brew install",
    "winget": "winget install",
}
# Check -> manager -> packages; "a|b" is the first of these that the manager knows.
PACKAGES = {
    "path tracer": {
        "apt-get": ["libllvm19|libllvm20|libllvm21|libllvm22", "libatomic1"],
        "dnf": ["llvm-libs", "libatomic"],
        "pacman": ["llvm-libs"],
        "brew": ["llvm"],
        "winget": ["LLVM.LLVM"],
    },
    "graphics": {
        "apt-get": ["libvulkan1", "mesa-vulkan-drivers"],
        "dnf": ["vulkan-loader", "mesa-vulkan-drivers"],
        "pacman": ["vulkan-icd-loader", "vulkan-swrast"],
    },
    "window": {
        "apt-get": ["libgl1", "libegl1", "libx11-6", "libxext6", "libxcursor1", "libxi6", "libxinerama1", "libxrandr2"],
        "dnf": ["libglvnd-glx", "libglvnd-egl", "libX11", "libXext", "libXcursor", "libXi", "libXinerama", "libXrandr"],
        "pacman": ["libglvnd", "libx11", "libxext", "libxcursor", "libxi", "libxinerama", "libxrandr"],
    },
}

# Drivers and native libraries can end the process that loads them: each of these is asked in one of its own.
_ASK_GRAPHICS = """
import json
from dataclasses import asdict
from lambent.realtime.device import adapter_info, open_device
print("answer " + json.dumps(asdict(adapter_info(open_device()))))
"""
_ASK_WINDOW = """
import glfw
from imgui_bundle import imgui, implot
print("answer true" if glfw.init() else "answer false")
"""
_ASK_DENOISER = "import pyoidn; print('answer true')"


@dataclass(frozen=True)
class Check:
    """One line of the report. What is `essential` and not `ok` makes the command fail."""

    name: str
    ok: bool
    found: str
    essential: bool = False


def command(json: Json = False) -> None:
    """Look at this machine: path tracer, graphics adapter, window, memory, film; and say how to mend what is missing.

    The exit code is 1 when something essential is missing.

    Example: lambent doctor
    """
    checks = [check() for check in CHECKS]
    packages = missing_packages(checks)
    ok = all(check.ok for check in checks if check.essential)
    mend = mending_command(packages)
    result = {
        "ok": ok,
        "python": platform.python_version(),
        "system": platform.platform(),
        "cores": os.cpu_count(),
        "checks": [asdict(check) for check in checks],
        "packages": packages,
        "mend": mend,
    }
    rows = [(_mark(check), check.name, check.found) for check in checks]
    text = table([("  ", "python", f"{result['python']} on {result['system']}"), *rows])
    show(result, f"{text}\n\nTo mend: {mend}" if mend else text, json)
    if not ok:
        raise typer.Exit(1)


def check_path_tracer() -> Check:
    from lambent.bake.engine import MEND, probe_engine

    probe = probe_engine()
    if probe.engine is None:
        reasons = list(probe.failures) if _manager() else [*probe.failures, MEND]
        return Check("path tracer", False, "; ".join(reasons), essential=True)
    version = f" {probe.engine.llvm_version}" if probe.engine.llvm_version else ""
    found = f"{probe.engine.variant}{version}, {probe.engine.threads} threads"
    return Check("path tracer", True, found, essential=True)


def check_denoiser() -> Check:
    answer, reason = _ask(_ASK_DENOISER)
    return Check("denoiser", answer is not None, "Open Image Denoise" if answer else reason, essential=True)


def check_graphics() -> Check:
    answer, reason = _ask(_ASK_GRAPHICS)
    if not isinstance(answer, dict):
        return Check("graphics", False, reason, essential=True)
    software = " (software: works, slowly)" if answer["type"] == "CPU" else ""
    return Check("graphics", True, f"{answer['name']}, {answer['backend']}{software}", essential=True)


def check_window() -> Check:
    answer, reason = _ask(_ASK_WINDOW)
    if answer is None:
        return Check("window", False, reason)
    return Check("window", True, "display found" if answer else "no display here: pictures and films only")


def check_memory() -> Check:
    gigabytes = memory_bytes() / 1e9
    return Check("memory", gigabytes >= MEMORY_NEEDED_GB, f"{gigabytes:.1f} GB ({MEMORY_NEEDED_GB} GB needed)")


def check_film() -> Check:
    try:
        import imageio_ffmpeg

        return Check("film", True, f"ffmpeg {imageio_ffmpeg.get_ffmpeg_version()}")
    except (ImportError, RuntimeError) as error:
        return Check("film", False, f"no ffmpeg: pictures only ({error})")


CHECKS: tuple[Callable[[], Check], ...] = (
    check_path_tracer, check_denoiser, check_graphics, check_window, check_memory, check_film,
)  # fmt: skip


def memory_bytes() -> int:
    """Physical memory of this machine."""
    if sys.platform == "win32":
        import ctypes

        kilobytes = ctypes.c_ulonglong()
        ctypes.windll.kernel32.GetPhysicallyInstalledSystemMemory(ctypes.byref(kilobytes))
        return kilobytes.value * 1024
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def missing_packages(checks: list[Check]) -> list[str]:
    """System packages for this machine's package manager that the failed checks want."""
    manager = _manager()
    failed = [PACKAGES.get(check.name, {}) for check in checks if not check.ok]
    return [package for packages in failed for package in packages.get(manager or "", [])]


def mending_command(packages: list[str]) -> str | None:
    """The one command that installs `packages`, or None where there is nothing it could install."""
    manager = _manager()
    if not packages or manager is None:
        return None
    chosen = [_first_known(manager, package.split("|")) for package in packages]
    sudo = "sudo " if manager in ("apt-get", "dnf", "pacman") and os.geteuid() != 0 else ""
    return f"{sudo}{MANAGERS[manager]} {' '.join(chosen)}"


def _manager() -> str | None:
    return next((name for name in MANAGERS if shutil.which(name)), None)


def _first_known(manager: str, names: list[str]) -> str:
    if manager != "apt-get" or len(names) == 1:
        return names[0]
    asked = ((name, subprocess.run(["apt-cache", "show", name], capture_output=True, check=False)) for name in names)
    return next((name for name, answer in asked if answer.returncode == 0), names[0])


def _ask(program: str) -> tuple[object, str]:
    """What a small program answers in a process of its own, or (None, one line of why not)."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, timeout=PROBE_SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return None, f"no answer within {PROBE_SECONDS} s"
    answer = next((line for line in done.stdout.splitlines() if line.startswith("answer ")), None)
    if done.returncode == 0 and answer is not None:
        return jsonlib.loads(answer.removeprefix("answer ")), ""
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    return None, lines[-1] if lines else f"ended with code {done.returncode}"


def _mark(check: Check) -> str:
    return "ok" if check.ok else "NO" if check.essential else "- "
