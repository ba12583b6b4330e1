"""The command line: ``armangle COMMAND``. Degrees in arguments and on screen, radians in files and JSON.

A command is one module with ``HELP``, ``EXAMPLE``, ``configure(parser)`` and ``run(args)``, and one line in
the list of :mod:`armangle.cli.main`; it is imported when it is called, so that help stays fast.
"""

from .main import main

__all__ = ["main"]
