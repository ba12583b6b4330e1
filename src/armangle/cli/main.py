"""From words on the command line to a command, and from errors to exit statuses."""

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
    NoSolutionError,
    OutputError,
    PathError,
    UnreachableError,
    needed,
)
from .messages import keep_whole, note

COMMANDS = {
    "demo": "see it work: an arm close to its limits goes along a line, five ways",
    "robots": "list the arms of the catalogue",
    "inspect": "read an arm from URDF or MJCF: is it S-R-S, and how exactly",
    "body": "balls and capsules that contain a robot's collision shapes",
    "fk": "joints to pose, arm angle and global configuration",
    "ik": "a pose to joints: the nearest, all, or those of an arm angle and branch",
    "arcs": "the arm angles that keep all joints within their limits",
    "follow": "step along a file of poses",
    "plan": "plan a whole file of poses, proven between them, or say why not",
    "place": "where to put the robot for a file of poses, with the best yaw",
    "reach": "make, resume, verify a map of what an arm reaches",
    "retime": "times for a joint file: a trajectory within the joints' bounds",
    "track": "follow a stream of poses as a tracker would: error, speeds, statuses",
    "plot": "draw the circle, the joints, a motion or a feasible map into a file",
    "view": "show the arm in the browser and move it by hand",
}
"""Every command with one line of help; its module is ``_NAME.py`` beside this one."""

SHELLS = ("bash", "zsh", "tcsh")
OK, NO_SOLUTION, BAD_INPUT = 0, 1, 2
_INTERRUPTED = 130
_NEGATIVE = re.compile(r"-\.?\d")

_FITTED = "the S-R-S arm fitted to the file: --length-tolerance and --angle-tolerance in place of --inexact"

_EPILOG = """\
Degrees and metres in arguments and on screen, mm where an option says so;
radians in files and --json.
Exit status: 0 ok, 1 no solution (with the reason), 2 bad input.
'armangle COMMAND --help' shows a command's options and an example."""


class _Parser(argparse.ArgumentParser):
    """Says what is wrong with the words as every other message is said."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        note(f"{self.prog}: error: {message}")
        self.exit(BAD_INPUT)


class Command(Protocol):
    """What the module of a command holds."""

    HELP: str
    EXAMPLE: str

    def configure(self, parser: argparse.ArgumentParser) -> None:
        """Add the arguments."""

    def run(self, args: argparse.Namespace) -> int:
        """Do it and return the exit status."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        The words behind ``armangle``; those of the process by default.

    Returns
    -------
    int
        0 ok, 1 no solution, 2 bad input; 130 when interrupted.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    keep_whole(words)
    try:
        status = _run(words)
        sys.stdout.flush()
        return status
    except SystemExit as stop:  # argparse has said what it had to
        return int(stop.code or 0)
    except (UnreachableError, NoSolutionError, PathError) as error:
        return _complain(error, NO_SOLUTION)
    except ArmangleError as error:
        return _complain(error, BAD_INPUT)
    except BrokenPipeError:  # the reader has seen enough, as in "armangle robots | head -1"
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK
    except OSError as error:  # files have errors of their own: this is the terminal or what stands for it
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 - nothing more can be said there
        return _complain(OutputError(f"cannot write the output: {error.strerror}"), BAD_INPUT)
    except KeyboardInterrupt:
        return _INTERRUPTED


def _complain(error: Exception, status: int) -> int:
    note(f"armangle: {_in_options(str(error))}")
    return status


def _in_options(message: str) -> str:
    """Return a message whose way out is an attribute of Python with what there is of the command line."""
    from ..arm.near import NOMINAL

    return message.replace(NOMINAL, _FITTED)


def _run(words: list[str]) -> int:
    top = _top_parser()
    if not words or words[0].startswith("-"):
        top.parse_args(words)
        top.print_help()
        return BAD_INPUT
    name, *rest = words
    if name not in COMMANDS:
        near = get_close_matches(name, COMMANDS, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"the commands are {', '.join(COMMANDS)}"
        top.error(f"there is no command {name!r}; {hint}")
    command = _command(name)
    parser = _Parser(
        prog=f"armangle {name}",
        description=command.HELP,
        epilog=f"example:\n{command.EXAMPLE}",
        formatter_class=_formatter,
        allow_abbrev=False,
    )
    command.configure(parser)
    # A leading blank tells argparse that -0.1,0.2 is a value and no option; numbers may begin with one.
    values = [f" {word}" if _NEGATIVE.match(word) else word for word in rest]
    args = parser.parse_intermixed_args(values)  # files and options in any order
    with warnings.catch_warnings():
        _warn_as_notes()
        return command.run(args)


def _warn_as_notes() -> None:
    """Let warnings be printed as remarks are, each once, without the line of Python that gave them."""
    said = set[str]()

    def remark(message: Warning | str, *_: object) -> None:
        if str(message) not in said:
            said.add(str(message))
            note(f"armangle: {message}")

    warnings.simplefilter("always", UserWarning)
    warnings.showwarning = cast("Any", remark)


def _command(name: str) -> Command:
    return cast(Command, importlib.import_module(f".commands.{name}", __package__))


def _formatter(prog: str) -> argparse.HelpFormatter:
    return argparse.RawDescriptionHelpFormatter(prog, max_help_position=26, width=79)


def _top_parser() -> argparse.ArgumentParser:
    width = max(map(len, COMMANDS))
    listed = "\n".join(f"  {name:{width}}  {line}" for name, line in COMMANDS.items())
    parser = _Parser(
        prog="armangle",
        usage="armangle [-h] [--version] [--cmake-dir] [--print-completion SHELL] COMMAND ...",
        description="Exact inverse kinematics for 7-axis S-R-S arms.",
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
    """Prints the version; the compiled core, which knows it, is loaded for this alone."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from .._core import ISA, __version__

        print(f"armangle {__version__} ({ISA})")
        parser.exit()


class _CMakeDir(argparse.Action):
    """Prints the folder of armangleConfig.cmake, which an installed package holds."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        folder = Path(__file__).resolve().parents[1] / "cmake"
        if not folder.is_dir():
            raise OutputError(f"there is no {folder}: the CMake files come with 'pip install armangle'")
        print(folder)
        parser.exit()
