"""From command-line words to a command, and from errors to exit statuses."""

from __future__ import annotations

import argparse
import importlib
import os
import re
import sys
import warnings
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn, Protocol, cast

from ..errors import (
    ArmangleError,
    MissingExtraError,
    ModelError,
    NoSolutionError,
    OutputError,
    PathError,
    UnreachableError,
    needed,
)
from .messages import keep_whole, note

COMMANDS = {
    "demo": "show a KUKA iiwa that moves along a line close to its joint limits",
    "robots": "list the arms of the catalogue",
    "inspect": "show an arm, its pose at given joints, and its collision model",
    "ik": "joints of a pose: the nearest, all, or the feasible intervals",
    "plan": "plan a file of poses, proven between them, or step along it",
    "retime": "give a joint file times within the bounds of the joints",
    "track": "follow a stream of poses as a teleoperated arm does",
    "reach": "make, resume and verify a map of the reachable poses",
    "place": "find base positions for a file of poses",
    "view": "show the arm in the browser and move it by hand",
}
"""Every command with one line of help; its module is ``commands/NAME.py``."""

SHELLS = ("bash", "zsh", "tcsh")
OK, NO_SOLUTION, BAD_INPUT = 0, 1, 2
_INTERRUPTED = 130
_NEGATIVE = re.compile(r"-\.?\d")

_INSPECT = "armangle inspect FILE {} -o arm.urdf"  # reads a file differently, for --robot arm.urdf
_FITTED = f"the S-R-S arm fitted to the file: {_INSPECT.format('--fit srs')}"
_DOORS = f"On the command line: {_INSPECT.format('--fit srs')}, or --fit own,MM,DEG."
_LIMITS = {"continuous_limits='use'": _INSPECT.format("--continuous-limits use")}

_EPILOG = """\
Arguments and the screen use degrees and metres, and mm if an option says so.
Files and --json use radians.
Exit status: 0 ok, 1 no solution (with the reason), 2 bad input.
'armangle COMMAND --help' shows the options of a command and an example."""


class _Parser(argparse.ArgumentParser):
    """Reports argument errors in the same form as other messages."""

    def error(self, message: str) -> NoReturn:
        """Print usage and message, and exit with the status for wrong input."""
        self.print_usage(sys.stderr)
        note(f"{self.prog}: error: {message}")
        self.exit(BAD_INPUT)


class Command(Protocol):
    """The interface of a command's module."""

    HELP: str
    EXAMPLE: str

    def configure(self, parser: argparse.ArgumentParser) -> None:
        """Add the arguments."""

    def run(self, args: argparse.Namespace) -> int:
        """Run it and return the exit status."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the words after ``armangle`` (those of the process by default) and return the exit status.

    0 ok, 1 no solution, 2 bad input; 130 if interrupted.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    keep_whole(words)
    try:
        status = _run(words)
        sys.stdout.flush()
        return status
    except SystemExit as stop:  # argparse has printed its message
        return int(stop.code or 0)
    except (UnreachableError, NoSolutionError, PathError) as error:
        return _complain(error, NO_SOLUTION)
    except ArmangleError as error:
        return _complain(error, BAD_INPUT)
    except BrokenPipeError:  # the reader has closed the pipe, as in "armangle robots | head -1"
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK
    except OSError as error:  # files raise other errors: this is the terminal or its replacement
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 - nothing more can be said there
        return _complain(OutputError(f"cannot write the output: {error.strerror}"), BAD_INPUT)
    except KeyboardInterrupt:
        return _INTERRUPTED


def _complain(error: Exception, status: int) -> int:
    """Print an error in the command line's words, and return the exit status."""
    from ..arm.chain import NOMINAL

    doors = f"\n{_DOORS}" if isinstance(error, ModelError) and "tolerance" in str(error) else ""
    note(f"armangle: {str(error).replace(NOMINAL, _FITTED)}{doors}")
    return status


def _run(words: list[str]) -> int:
    """Run the command of the given words and return its exit status."""
    top = _top_parser()
    asked = top.parse_args(words)
    if asked.command is None:
        top.print_help()
        return BAD_INPUT
    name, rest = asked.command, asked.words
    if name not in COMMANDS:
        near = get_close_matches(name, COMMANDS, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"the commands are {', '.join(COMMANDS)}"
        top.error(f"there is no command {name!r}; {hint}")
    command = _command(name)
    parser = command_parser(name, command)
    # A leading blank tells argparse that -0.1,0.2 is a value and not an option.
    values = [f" {word}" if _NEGATIVE.match(word) else word for word in rest]
    args = parser.parse_intermixed_args(values)  # files and options in any order
    from .._threads import threads

    with warnings.catch_warnings(), threads(asked.threads):
        _warn_as_notes()
        return command.run(args)


def command_parser(name: str, command: Command | None = None) -> argparse.ArgumentParser:
    """Return the parser of a command."""
    command = _command(name) if command is None else command
    parser = _Parser(
        prog=f"armangle {name}",
        description=command.HELP,
        epilog=f"example:\n{command.EXAMPLE}",
        formatter_class=_formatter,
        allow_abbrev=False,
    )
    command.configure(parser)
    return parser


def _warn_as_notes() -> None:
    """Make Python print warnings as notes of the command line, each once."""
    said = set[str]()

    def remark(message: Warning | str, *_: object) -> None:
        """Print a warning with the option's name instead of Python's, unless it was printed before."""
        for python, option in _LIMITS.items():
            message = str(message).replace(python, option)
        if str(message) not in said:
            said.add(str(message))
            note(f"armangle: {message}")

    warnings.simplefilter("always", UserWarning)
    warnings.showwarning = cast("Any", remark)


def _command(name: str) -> Command:
    """Return the module of a command."""
    return cast(Command, importlib.import_module(f".commands.{name}", __package__))


def _formatter(prog: str) -> argparse.HelpFormatter:
    """Return the format of help texts: 79 columns, with the line breaks of their descriptions."""
    return argparse.RawDescriptionHelpFormatter(prog, max_help_position=26, width=79)


def _top_parser() -> argparse.ArgumentParser:
    """Return the parser of the options before the command."""
    width = max(map(len, COMMANDS))
    listed = "\n".join(f"  {name:{width}}  {line}" for name, line in COMMANDS.items())
    parser = _Parser(
        prog="armangle",
        usage="armangle [-h] [--version] [--cmake-dir] [--print-completion SHELL]\n"
        "                [--threads N] COMMAND ...",
        description="Exact inverse kinematics for redundant 7-axis arms.",
        epilog=f"commands:\n{listed}\n\n{_EPILOG}",
        formatter_class=_formatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    parser.add_argument(
        "--cmake-dir", action=_CMakeDir, nargs=0, help="show where CMake finds the C++ headers and exit"
    )
    parser.add_argument(
        "--print-completion", action=_Completion, choices=SHELLS, metavar="SHELL",
        help="print completions for bash, zsh or tcsh and exit (extra: completion)",
    )  # fmt: skip
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="threads; 0: all cores (default)")
    parser.add_argument("command", nargs="?", help=argparse.SUPPRESS)
    parser.add_argument("words", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    return parser


class _Completion(argparse.Action):
    """Prints a shell's completions of every command whose extra is installed."""

    def __call__(self, parser: argparse.ArgumentParser, _: object, shell: Any, *rest: object) -> None:
        shtab = needed("shtab", "completions need", "completion")
        commands = parser.add_subparsers()
        for name, line in COMMANDS.items():
            try:
                command = _command(name)
            except MissingExtraError:
                continue
            command.configure(commands.add_parser(name, help=line, allow_abbrev=False))
        print(shtab.complete(parser, shell=shell))
        parser.exit()


class _Version(argparse.Action):
    """Prints the version; loads the compiled core, which holds it, for this alone."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from .._core import ISA, __version__

        print(f"armangle {__version__} ({ISA})")
        parser.exit()


class _CMakeDir(argparse.Action):
    """Prints the folder of armangleConfig.cmake in an installed package."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        folder = Path(__file__).resolve().parents[1] / "cmake"
        if not folder.is_dir():
            raise OutputError(f"there is no {folder}: the CMake files come with 'pip install armangle'")
        print(folder)
        parser.exit()
