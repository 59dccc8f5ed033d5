#!/usr/bin/env python3
"""Sets Lambent up beside itself and runs it. Needs nothing but Python 3.11 to 3.13.

    python3 run.py demo [ARGS]     the whole flow: measure, fit, bake, walk
    python3 run.py lambent ARGS    any command, e.g. `python3 run.py lambent doctor`
    python3 run.py test [ARGS]     style, types and tests; with ARGS, pytest alone with these
    python3 run.py test --bounds [ARGS]  likewise, pytest alone: compiled loops check every index
    python3 run.py docs            the documentation as a site, in out/site

The first run makes .venv here, installs the versions named in constraints.txt, and asks `lambent doctor` what the
system lacks; on Debian and Ubuntu it installs that, elsewhere it prints the one command. Later runs start at once
and need no network.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

HOME = Path(__file__).resolve().parent
VENV = HOME / ".venv"
PYTHON = VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
STAMP = VENV / "lambent-ready.json"
PYTHONS = ((3, 11), (3, 12), (3, 13))  # those that every dependency has ready-made packages for
BLENDER = "bpy==5.0.1"  # Blender as a package, for Python 3.11; tests that need it skip where it is not
BLENDER_PACKAGES = ["libsm6", "libgl1", "libxfixes3", "libxi6", "libxkbcommon0", "libxrender1"]  # that it loads
# Of npm: the glTF validator, and what checks the JavaScript of sites; tests that need one skip where it is not.
NODE_PACKAGES = ("gltf-validator@2.0.0-dev.3.10", "typescript@5.9.3", "@webgpu/types@0.1.74", "prettier@3.6.2")
WINDOW_TEST_PACKAGES = {"Xvfb": "xvfb", "xdotool": "xdotool"}
BROWSERS = "chromium", "firefox-esr"  # of Debian; elsewhere the tests take those that are there, or skip


class Stop(Exception):
    """Ends the program with one message."""


def main(arguments):
    if sys.version_info[:2] not in PYTHONS:
        return subprocess.call([*suitable_python(), __file__, *arguments])
    tasks = {"demo": run_demo, "lambent": run_lambent, "test": run_tests, "docs": run_docs}
    if not arguments or arguments[0] not in tasks:
        print(__doc__)
        return 0 if arguments[:1] in (["-h"], ["--help"]) else 2
    os.environ["PYTHONUTF8"] = "1"
    if arguments[0] in ("demo", "lambent"):  # nothing is imported from the folder that the user is in
        os.environ["PYTHONSAFEPATH"] = "1"
    set_up(for_tests=arguments[0] in ("test", "docs"))
    return tasks[arguments[0]](arguments[1:])


def suitable_python():
    """Command of another Python on this machine that will do, the newest first."""
    for version in reversed(PYTHONS):
        name = "{}.{}".format(*version)
        question = ["-c", f"import sys; sys.exit(sys.version_info[:2] != {version})"]
        for command in (["python" + name], ["py", "-" + name]):
            if works([*command, *question]):
                return command
    found = "{}.{}".format(*sys.version_info[:2])
    raise Stop(f"Lambent needs Python 3.11, 3.12 or 3.13; this is {found} ({sys.executable}), and there is no other.")


def run_demo(arguments):
    return run_lambent(["demo", *arguments])


def run_lambent(arguments):
    return subprocess.call([PYTHON, "-m", "lambent.cli.main", *arguments])


def run_tests(arguments):
    if arguments[:1] == ["--bounds"]:  # loops compiled with checks are kept apart from those without
        os.environ |= {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(VENV / "checked-loops")}
        arguments = arguments[1:] or ["-q"]
    if arguments:
        return subprocess.call([PYTHON, "-m", "pytest", *arguments], cwd=HOME)
    failed = []
    for command in (["ruff", "format", "--check"], ["ruff", "check"], ["mypy"], ["pytest", "-q", "-n", "auto"]):
        say(f"-- {' '.join(command)}")
        if subprocess.call([PYTHON, "-m", *command], cwd=HOME) != 0:
            failed.append(command[0])
    say(f"failed: {', '.join(failed)}" if failed else "all passed")
    return 1 if failed else 0


def run_docs(arguments):
    return subprocess.call([PYTHON, "-m", "mkdocs", "build", *arguments], cwd=HOME)


def set_up(for_tests):
    """Bring .venv and the system to what this version needs; do nothing where they already are."""
    wanted = fingerprint()
    ready = read_stamp()
    if ready.get("wanted") == wanted and (ready.get("tests") or not for_tests) and PYTHON.exists():
        return
    # Whatever happens from here on, an unfinished .venv is not taken for a finished one.
    STAMP.unlink(missing_ok=True)
    make_venv()
    install_package(for_tests)
    if for_tests:
        install_node_packages()
        install_blender()
        install_browsers()
    install_system_parts(for_tests)
    STAMP.write_text(json.dumps({"wanted": wanted, "tests": for_tests}), encoding="utf-8")


def fingerprint():
    """Changes whenever the installation has to be done again: requirements, Python, or the place of this folder."""
    parts = [(HOME / name).read_bytes() for name in ("pyproject.toml", "constraints.txt")]
    parts += [sys.version.encode(), str(HOME).encode(), *(name.encode() for name in NODE_PACKAGES), BLENDER.encode()]
    return hashlib.sha256(b"\0".join(parts)).hexdigest()


def read_stamp():
    try:
        return json.loads(STAMP.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def make_venv():
    if works([PYTHON, "-m", "pip", "--version"]) and same_python():
        return
    say(f"making {VENV}")
    if VENV.exists():
        shutil.rmtree(VENV)
    # Debian and Ubuntu ship Python without ensurepip, in a package of its own.
    if not works([sys.executable, "-c", "import ensurepip, venv"]):
        package = "python{}.{}-venv".format(*sys.version_info[:2])
        if not apt_install([package]):
            raise Stop(f"This Python cannot make environments. Run: sudo apt-get install -y {package}")
    call([sys.executable, "-m", "venv", VENV], "the environment could not be made")


def same_python():
    answer = subprocess.run([PYTHON, "-c", "import sys; print(sys.version)"], capture_output=True, text=True)
    return answer.stdout.strip() == sys.version


def install_package(for_tests):
    say("installing Lambent and what it needs (about 1 GB; a few minutes the first time)")
    what = f"{HOME}[{'test' if for_tests else 'all'}]"
    pip = [PYTHON, "-m", "pip", "install", "--disable-pip-version-check", "--no-input"]
    pip += [] if sys.stderr.isatty() else ["--quiet"]
    call([*pip, "-c", HOME / "constraints.txt", "-e", what], "installation failed; is there a network connection?")


def install_node_packages():
    """NODE_PACKAGES into .venv/node, where there is npm; without them the tests say what they skip."""
    npm = shutil.which("npm")
    if npm is None:
        return
    options = ["--prefix", VENV / "node", "--no-save", "--no-package-lock", "--no-audit", "--no-fund", "--silent"]
    if subprocess.call([npm, "install", *options, *NODE_PACKAGES], stdout=subprocess.DEVNULL) != 0:
        say(f"npm could not install {', '.join(NODE_PACKAGES)}; the tests that need them will skip")


def install_blender():
    """Without its requirements: it asks for numpy 1, and what the tests use of it runs with ours."""
    if sys.version_info[:2] != (3, 11):
        return
    pip = [PYTHON, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--quiet", "--no-deps"]
    if subprocess.call([*pip, BLENDER]) != 0:
        say(f"pip could not install {BLENDER}; the tests that need it will skip")
    elif not works([PYTHON, "-c", "import bpy"]):
        apt_install(BLENDER_PACKAGES)


def install_browsers():
    """By themselves: where the system has no such package, the others are installed all the same."""
    for browser in BROWSERS if sys.platform.startswith("linux") else ():
        if not shutil.which(browser) and not apt_install([browser]):
            say(f"{browser} could not be installed; the tests that open sites in it skip")


def install_system_parts(for_tests):
    """Install what `lambent doctor` misses where we may, otherwise stop with its one command."""
    say("looking at this machine")
    report = doctor()
    wanted = list(report["packages"])
    if for_tests and sys.platform.startswith("linux"):
        wanted += [package for program, package in WINDOW_TEST_PACKAGES.items() if not shutil.which(program)]
    if wanted and apt_install(wanted):
        report = doctor()
    if not report["ok"]:
        found = "; ".join(f"{c['name']}: {c['found']}" for c in report["checks"] if c["essential"] and not c["ok"])
        raise Stop(f"Something is missing: {found}." + (f"\nRun: {report['mend']}" if report["mend"] else ""))


def doctor():
    command = [PYTHON, "-m", "lambent.cli.main", "doctor", "--json"]
    answer = subprocess.run(command, stdout=subprocess.PIPE, text=True, encoding="utf-8")
    try:
        return json.loads(answer.stdout)
    except ValueError:
        raise Stop(f"`lambent doctor` failed with exit code {answer.returncode}") from None


def apt_install(packages):
    """Install Debian packages, "a|b" meaning the first there is; False where this is not possible without asking."""
    if not shutil.which("apt-get"):
        return False
    as_root = [] if os.geteuid() == 0 else ["sudo", "-n"]
    if as_root and not works(["sudo", "-n", "true"]):
        return False
    say(f"installing system packages: {' '.join(packages)}")
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    # A foreign source that does not answer makes `update` fail; the packages may be known all the same.
    subprocess.call([*as_root, "apt-get", "update", "-qq"], env=environment)
    chosen = [first_known(package.split("|")) for package in packages]
    command = [*as_root, "apt-get", "install", "-y", "-qq", "--no-install-recommends", *chosen]
    return subprocess.call(command, env=environment, stdout=subprocess.DEVNULL) == 0


def first_known(names):
    return next((name for name in names if works(["apt-cache", "show", name])), names[0])


def works(command):
    """Whether a command exists and succeeds, quietly."""
    try:
        return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
    except OSError:
        return False


def call(command, message):
    if subprocess.call(command) != 0:
        raise Stop(message)


def say(text):
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except Stop as stop:
        say(f"run.py: {stop}")
        sys.exit(1)
    except KeyboardInterrupt:
        say("interrupted")
        sys.exit(130)
