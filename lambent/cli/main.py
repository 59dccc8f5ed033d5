"""`lambent`: finds the commands and reports errors.

Every module in this folder or in `materials/` with a function `command` is a command named after the module.
Exit codes: 0 done; 1 done with a negative result (a failed check, a missing part); 2 wrong input; 130 interrupted.

The top of the file imports only modules that Python has already loaded, so that Ctrl-C works while the rest is
imported.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
from typing import TYPE_CHECKING

from lambent.core.interruption import interrupt, is_interruption

if TYPE_CHECKING:
    import typer
    from typer.exceptions import TyperException

INTERRUPTED = 130
AGAIN_S = 0.02
INTERRUPTION = "lambent: interrupted; finished work is kept\n"
UNNAMED = "output, or a cache of compiled kernels (of Dr.Jit or numba)"  # a file that a fault of the disk does not name
NO_ROOM = "failed to map segment"  # message of the ImportError if a library does not fit into memory
MEMORY = "out of memory; close other programs, raise the limit (ulimit -v), or ask for less"
LOST = "the graphics device was lost, as when its driver restarts; a window's edits are in its session: start again"
FAULTS_OF_THE_DISK = {
    errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR,
    errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG, errno.EIO,
}  # fmt: skip


def main() -> None:
    """Entry point of the `lambent` command."""
    signal.signal(signal.SIGINT, _leave)
    os.environ["PYTHONSAFEPATH"] = "1"  # processes that libraries start import nothing from the current folder
    build_app()  # imports the commands; no work can be lost yet
    sys.unraisablehook = _unraisable
    signal.signal(signal.SIGINT, interrupt)
    try:
        code = run(sys.argv[1:])
    except KeyboardInterrupt:  # during the report at the end of the command
        code = INTERRUPTED
    signal.signal(signal.SIGINT, lambda *_: os._exit(code))  # the result is printed; skip the libraries' clean-up
    sys.exit(code)


def build_app() -> typer.Typer:
    """The application with every command found."""
    import typer

    from lambent import cli
    from lambent.cli import materials
    from lambent.cli.console import options
    from lambent.core.discovery import modules_in

    app = typer.Typer(
        name="lambent",
        help="Measured materials where they will live: fit, place, bake, walk.",
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    )
    app.callback()(options)
    for name, module in sorted((modules_in(cli, having="command") | modules_in(materials, having="command")).items()):
        app.command(name)(module.command)
    return app


def run(arguments: list[str]) -> int:
    """Run one command line and return its exit code; user errors are one line on stderr."""
    from typer.exceptions import TyperException

    from lambent.cli.console import log_to_stderr
    from lambent.core.errors import UserError
    from lambent.core.extras import missing
    from lambent.core.progress import Cancelled

    log_to_stderr()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a terminal without a character still shows the rest
    try:
        code = build_app()(arguments or ["--help"], prog_name="lambent", standalone_mode=False) or 0
        sys.stdout.flush()
    except UserError as error:
        if not is_interruption(error.__cause__):  # a reader that was interrupted reports a faulty file
            return _fail(str(error))
        code = INTERRUPTED
    except TyperException as error:  # unknown commands and options, missing arguments
        return _fail(_usage_fault(error))
    except (Cancelled, KeyboardInterrupt):
        code = INTERRUPTED
    except BrokenPipeError:
        # The reader of the output has closed; flushing at exit must not fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if isinstance(error, OSError) and error.errno in FAULTS_OF_THE_DISK:
            return _fail(f"{error.filename or UNNAMED}: cannot be written ({error.strerror})")
        if is_interruption(error):
            code = INTERRUPTED
        elif isinstance(error, ModuleNotFoundError) and (said := missing(error)) is not None:
            return _fail(str(said))
        elif _lost_device(error):
            return _fail(LOST)
        elif isinstance(error, MemoryError) or (isinstance(error, ImportError) and NO_ROOM in str(error)):
            return _fail(MEMORY)
        else:
            raise
    if code == INTERRUPTED:
        sys.stderr.write(INTERRUPTION)
    return int(code)


def _lost_device(error: Exception) -> bool:
    """Whether the graphics device is gone: its driver has restarted, or it was unplugged."""
    if "wgpu" not in sys.modules:
        return False
    from lambent.realtime.gpu.device import is_lost

    return is_lost(error)


def _usage_fault(error: TyperException) -> str:
    """The message for a wrong command line, with the command that shows help."""
    message = error.format_message().replace("Value error, ", "").replace("Input should be", "it has to be")
    context = getattr(error, "ctx", None)
    return message if context is None else f"{message.removesuffix('.')} (see `{context.command_path} --help`)"


def _leave(*_: object) -> None:
    """End at once on Ctrl-C, without the traceback of an import."""
    os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, INTERRUPTION.encode("ascii"))
    os._exit(INTERRUPTED)


def _unraisable(fault: sys.UnraisableHookArgs) -> None:
    """Interrupt again, a moment later, if Ctrl-C hit code that cannot raise, such as a destructor."""
    if issubclass(fault.exc_type, KeyboardInterrupt):
        import threading

        later = threading.Timer(AGAIN_S, signal.raise_signal, [signal.SIGINT])
        later.daemon = True
        later.start()
    else:
        sys.__unraisablehook__(fault)


def _fail(message: str) -> int:
    from lambent.core.plain import printable

    sys.stderr.write(f"lambent: error: {printable(' '.join(message.split()))}\n")
    return 2


if __name__ == "__main__":
    main()
