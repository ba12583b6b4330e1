"""Which pages may connect to the viewer: its own, and those of this machine."""

from __future__ import annotations

import importlib
import ipaddress
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from http import HTTPStatus
from inspect import isawaitable
from typing import Any
from urllib.parse import urlsplit

from ..errors import MissingExtraError

_LOCAL = frozenset({"localhost", "127.0.0.1", "::1"})
_ONE_AT_A_TIME = threading.Lock()


def may_talk(headers: Mapping[str, str]) -> bool:
    """Return whether a request comes from a page of the viewer, of this machine, or from no page at all.

    A browser sends the requesting page in ``Origin``. The page is the viewer's if its host is the requested
    one, in ``Host``. The host must be an address or a name of this machine: the owner of any other name could
    make it resolve to this machine.

    >>> may_talk({"Origin": "http://localhost:8080", "Host": "localhost:8080"})
    True
    >>> may_talk({"Origin": "https://example.org", "Host": "localhost:8080"})
    False
    """
    origin = headers.get("Origin")
    if origin is None:
        return True
    host = _host(origin)
    if host in _LOCAL:
        return True
    return host == _host(f"//{headers.get('Host', '')}") and (
        _is_address(host) or host == socket.gethostname().lower()
    )


def _host(url: str) -> str:
    """Return the host of an address, in lower case; '' if it has none."""
    try:
        return (urlsplit(url).hostname or "").lower()
    except ValueError:
        return ""


def _is_address(host: str) -> bool:
    """Return whether a host is given as an IP address."""
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


@contextmanager
def checked_origins() -> Iterator[None]:
    """Make the server that viser starts in this block reject pages of other sites.

    viser passes no check to its socket library, so its call of ``websockets.asyncio.server.serve`` is given
    one. Raises `MissingExtraError` if viser does not call it in the block: it would serve without the check.
    """
    module: Any = importlib.import_module("websockets.asyncio.server")
    with _ONE_AT_A_TIME:
        serve, called = module.serve, threading.Event()

        def serve_checked(handler: Any, *args: Any, process_request: Any = None, **named: Any) -> Any:
            """Serve with the check before the given handler of requests."""
            called.set()
            return serve(handler, *args, process_request=_checked(process_request), **named)

        module.serve = serve_checked
        try:
            yield
        finally:
            module.serve = serve
        if not called.is_set():
            raise MissingExtraError("the viewer needs a viser whose requests can be checked: 1.1")


def _checked(answer: Callable[[Any, Any], Any] | None) -> Callable[[Any, Any], Awaitable[Any]]:
    """Return a request handler that first checks where the request comes from."""

    async def answered(connection: Any, request: Any) -> Any:
        """Answer a request, or reject one that comes from a page of another site."""
        if not may_talk(request.headers):
            return connection.respond(HTTPStatus.FORBIDDEN, "this page belongs to another site\n")
        answered_as_before = None if answer is None else answer(connection, request)
        return await answered_as_before if isawaitable(answered_as_before) else answered_as_before

    return answered
