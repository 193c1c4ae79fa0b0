"""The command line ``vi-contact``: parses and prints, nothing else."""

import argparse
import logging
import signal
import sys
import traceback
from collections.abc import Callable, Sequence

from ...core.errors import Interrupted, OutOfTime, ViContactError
from ...core.version import __version__
from .case import add_case_commands
from .errors import (
    Parser,
    check_words,
    explain_errors,
    fail_together,
    is_of_pipe,
    keep_streams,
    say,
    world,
)
from .ida import add_ida_commands

_DESCRIPTION = """vi-contact computes structures that may lift off, bounce and slide. It checks
every time step. Start it with "mpirun -n N vi-contact" on N ranks. Options that begin with
-vi_contact_volume_ go to PETSc, for example -vi_contact_volume_snes_monitor."""
_PETSC = "-vi_contact_"
PIPE_STATUS = 128 + signal.SIGPIPE  # as shells have it where nobody reads what is written


def build_parser(command: str = "") -> argparse.ArgumentParser:
    """Build the parser of all commands and options.

    When the command is one that runs cases, the parser has those for runs alone, which need less.
    """
    top = Parser(prog="vi-contact", description=_DESCRIPTION)
    top.add_argument("--version", action="version", version=f"vi-contact {__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    add_case_commands(commands)
    add_ida_commands(commands)
    if command not in commands.choices:
        from .motion import add_motion_commands
        from .pictures import add_picture_commands
        from .post import add_post_commands
        from .strength import add_strength_command
        from .validate import add_validate_command

        add_motion_commands(commands)
        add_picture_commands(commands)
        add_post_commands(commands)
        add_strength_command(commands)
        add_validate_command(commands)
    return top


def split_petsc(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return (our own arguments, PETSc options).

    The latter are ``-vi_contact_... [value]``, our PETSc prefixes.
    """
    own: list[str] = []
    petsc: list[str] = []
    for before, argument in zip(["", *arguments], arguments, strict=False):
        is_option = argument.startswith(_PETSC)
        is_value = before.startswith(_PETSC) and not argument.startswith("-")
        if is_option or is_value:
            petsc.append(argument)
        else:
            own.append(argument)
    return own, petsc


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and print its text; return 0, 1 (one sentence on stderr) or more.

    Other statuses are 128 + n (signal n) and 75 (wall time).
    """
    # a process of our own: with DOLFINx 0.5 the compiler of forms tells the root its calls
    if arguments is None:
        logging.getLogger().addFilter(lambda record: record.levelno > logging.INFO)
    own, petsc = split_petsc(sys.argv[1:] if arguments is None else arguments)

    def command() -> None:
        options = build_parser(own[0] if own else "").parse_args(own)
        if petsc:
            import petsc4py

            petsc4py.init(["vi-contact", *petsc])
        check_words(own)
        spelling = getattr(options, "spelling", {})
        text = explain_errors(lambda: options.run(options), spelling)
        if text:
            say(text)

    return status_of(command)


def status_of(call: Callable[[], object]) -> int:
    """Call a command, or the main function of a script, and return 0.

    Other ends are as those of ``main``.
    """
    keep_streams()
    try:
        explain_errors(call, {})
    except (BrokenPipeError, ViContactError) as error:
        if is_of_pipe(error):
            return PIPE_STATUS
        fail_together(str(error))
        return _print_error(error, 1)
    except KeyboardInterrupt as error:
        stop = error if isinstance(error, Interrupted) else Interrupted()
        # on all ranks: a launcher kills what is left when the first one has failed
        if isinstance(error, OutOfTime):
            fail_together(str(error))
        return _print_error(stop, stop.status)
    except Exception:  # a defect: its traceback is shown, and the other ranks end too
        fail_together(traceback.format_exc())
        raise
    return 0


def _print_error(error: BaseException, status: int) -> int:
    """Print the sentence of an error on the first rank; return the status."""
    if world().rank == 0:
        print(f"vi-contact: {error}", file=sys.stderr, flush=True)
    return status
