"""`lambent doctor`: usable and missing parts of this machine, and the one command that installs the missing ones."""

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
from lambent.core.machine import core_count, memory_bytes, python_environment

MEMORY_NEEDED_GB = 4
PROBE_SECONDS = 120

# Package manager -> its command. The first manager found is used.
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

# Drivers and native libraries can crash the process that loads them, so each program runs in a separate process.
_ASK_GRAPHICS = """
import json
from dataclasses import asdict
from lambent.realtime.gpu.device import adapter_info, open_device
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
    """One line of the report. A check that is `essential` and not `ok` makes the command fail."""

    name: str
    ok: bool
    found: str
    essential: bool


def command(json: Json = False) -> None:
    """Check this machine: path tracer, graphics adapter, window, memory, film; print how to install what is missing.

    The exit code is 1 where something essential is missing.

    Example: lambent doctor
    """
    checks = [Check(name, *look(), essential) for name, essential, look in CHECKS]
    packages = missing_packages(checks)
    ok = all(check.ok for check in checks if check.essential)
    mend = mending_command(packages)
    result = {
        "ok": ok,
        "python": platform.python_version(),
        "system": platform.platform(),
        "cores": core_count(),
        "checks": [asdict(check) for check in checks],
        "packages": packages,
        "mend": mend,
    }
    rows = [("ok" if check.ok else "NO" if check.essential else "- ", check.name, check.found) for check in checks]
    text = table([("  ", "python", f"{result['python']} on {result['system']}"), *rows])
    show(result, f"{text}\n\nTo install what is missing: {mend}" if mend else text, json)
    if not ok:
        raise typer.Exit(1)


def _path_tracer() -> tuple[bool, str]:
    from lambent.baking.engine import MEND, probe_engine

    probe = probe_engine()
    engine = probe.engine
    if engine is None:
        return False, "; ".join([*probe.failures, *([] if _manager() else [MEND])])
    version = f" {engine.llvm_version}" if engine.llvm_version else ""
    return True, f"{engine.variant}{version}, {engine.threads} threads"


def _denoiser() -> tuple[bool, str]:
    answer, reason = _ask(_ASK_DENOISER)
    return answer is not None, "Open Image Denoise" if answer else reason


def _graphics() -> tuple[bool, str]:
    answer, reason = _ask(_ASK_GRAPHICS)
    if not isinstance(answer, dict):
        return False, reason
    software = " (software: slow)" if answer["type"] == "CPU" else ""
    return True, f"{answer['name']}, {answer['backend']}{software}"


def _window() -> tuple[bool, str]:
    answer, reason = _ask(_ASK_WINDOW)
    if answer is None:
        return False, reason
    return True, "display found" if answer else "no display: pictures and films only"


def _memory() -> tuple[bool, str]:
    gigabytes = memory_bytes() / 1e9
    return gigabytes >= MEMORY_NEEDED_GB, f"{gigabytes:.1f} GB ({MEMORY_NEEDED_GB} GB needed)"


def _film() -> tuple[bool, str]:
    try:
        import imageio_ffmpeg

        return True, f"ffmpeg {imageio_ffmpeg.get_ffmpeg_version()}"
    except (ImportError, RuntimeError) as error:
        return False, f"no ffmpeg: pictures only ({error})"


# Name, whether it is essential, and the check: returns whether it works, and a description.
CHECKS: tuple[tuple[str, bool, Callable[[], tuple[bool, str]]], ...] = (
    ("path tracer", True, _path_tracer), ("denoiser", True, _denoiser), ("graphics", True, _graphics),
    ("window", False, _window), ("memory", False, _memory), ("film", False, _film),
)  # fmt: skip


def missing_packages(checks: list[Check]) -> list[str]:
    """System packages that the failed checks need, for this machine's package manager."""
    manager, failed = _manager() or "", [check.name for check in checks if not check.ok]
    return [package for name in failed for package in PACKAGES.get(name, {}).get(manager, [])]


def mending_command(packages: list[str]) -> str | None:
    """The command that installs `packages`; None without packages or a package manager."""
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
    """The answer of a small program run in a separate process, or (None, the reason in one line)."""
    command = [sys.executable, "-c", program]
    try:
        done = subprocess.run(
            command, env=python_environment(), capture_output=True, text=True, timeout=PROBE_SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return None, f"test program gave no answer within {PROBE_SECONDS} s"
    answer = next((line for line in done.stdout.splitlines() if line.startswith("answer ")), None)
    if done.returncode == 0 and answer is not None:
        return jsonlib.loads(answer.removeprefix("answer ")), ""
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    return None, lines[-1] if lines else f"test program ended with code {done.returncode}"
