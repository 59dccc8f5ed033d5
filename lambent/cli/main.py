"""`lambent`: finds the commands and reports errors.

Every module of this folder with a function `command` is a command of the module's name; nothing else to register.
Exit codes: 0 done; 1 done, and the answer is no (a failed check, a missing part); 2 wrong input; 130 interrupted.
"""

from __future__ import annotations

import errno
import logging
import os
import sys
from typing import Annotated

import typer
from typer.exceptions import TyperException

import lambent
from lambent import cli
from lambent.core.discovery import modules_in
from lambent.core.errors import UserError
from lambent.core.progress import Cancelled

INTERRUPTED = 130
FAULTS_OF_THE_DISK = {
    errno.ENOSPC, errno.EDQUOT, errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR, errno.EISDIR,
    errno.ELOOP, errno.ENAMETOOLONG, errno.EIO,
}  # fmt: skip


def build_app() -> typer.Typer:
    """The application with every command found."""
    app = typer.Typer(
        name="lambent",
        help="Measured materials where they will live: fit, place, bake, walk.",
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    )
    app.callback()(_options)
    for name, module in modules_in(cli, having="command").items():
        app.command(name)(module.command)
    return app


def main() -> None:
    """Entry point of the `lambent` command."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command line and return its exit code; faults of the user are one line on stderr."""
    logging.basicConfig(format="lambent: %(message)s", level=logging.WARNING)
    try:
        code = build_app()(arguments or ["--help"], prog_name="lambent", standalone_mode=False) or 0
    except UserError as error:
        return _fail(str(error))
    except TyperException as error:  # unknown commands and options, missing arguments
        return _fail(error.format_message())
    except (Cancelled, KeyboardInterrupt):
        code = INTERRUPTED
    except SystemError as error:  # raised where an interruption meets the import of an extension module
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        code = INTERRUPTED
    except BrokenPipeError:
        # The reader of the output is gone; flushing at exit must not fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        if error.errno not in FAULTS_OF_THE_DISK:
            raise
        return _fail(f"{error.filename or 'output'}: cannot be written ({error.strerror})")
    if code == INTERRUPTED:
        sys.stderr.write("lambent: interrupted; what was finished is kept\n")
    return int(code)


def _fail(message: str) -> int:
    sys.stderr.write(f"lambent: error: {' '.join(message.split())}\n")
    return 2


def _version(value: bool) -> None:
    if value:
        typer.echo(lambent.__version__)
        raise typer.Exit


def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


if __name__ == "__main__":
    main()
