"""A server of viser that its own page alone can read and move.

Any page in the browser can reach a server on this computer, under its address or under a name
that leads there (DNS rebinding). So every request must name this computer as its host, come from
no other page, and have the token that is in the address of the view.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import threading
from contextlib import redirect_stdout
from functools import partial
from http import HTTPStatus
from io import StringIO
from typing import Any

import viser
import websockets.asyncio.server as protocol

from robostiff.errors import InputError, printable

HOST = "127.0.0.1"
_NAMES = (HOST, "localhost")
_LARGEST = 2**20  # bytes of a message of a page
_LOG = logging.getLogger(__name__)
_STARTS = threading.Lock()


def guarded_server(port: int, title: str) -> tuple[viser.ViserServer, str]:
    """A server that listens on a port or the next free one, and the address of its page.

    viser has no setting for checks of the handshake: they are handed to the function of websockets
    with which it begins to listen.

    Raises
    ------
    InputError
        When viser does not begin in this way.
    """
    token = secrets.token_urlsafe(16)
    serve, listening = protocol.serve, []

    def serve_guarded(handler: Any, *where: Any, process_request: Any, **more: Any) -> Any:
        listening.append(where)
        check = partial(_checked, token, process_request)
        more["max_size"] = _LARGEST
        return serve(partial(_handled, handler), *where, process_request=check, **more)

    with _STARTS, redirect_stdout(StringIO()):  # viser greets
        protocol.serve = serve_guarded  # type: ignore[assignment, misc]
        try:
            server = viser.ViserServer(host=HOST, port=port, verbose=False, label=title)
        finally:
            protocol.serve = serve  # type: ignore[misc]
        if not listening:
            server.stop()
            raise InputError(
                "viser", got=viser.__version__, expected="1.1, whose server can be guarded"
            )
    return server, f"http://{HOST}:{server.get_port()}/{token}/"


def _checked(token: str, answer: Any, connection: Any, request: Any) -> Any:
    """The answer to a request, without its token; a refusal of one from elsewhere."""
    hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
    if len(hosts) != 1 or hosts[0].rpartition(":")[0] not in _NAMES:
        return connection.respond(HTTPStatus.FORBIDDEN, "another host\n")
    if origins not in ([], [f"http://{hosts[0]}"]):
        return connection.respond(HTTPStatus.FORBIDDEN, "another page\n")
    given, _, rest = request.path.removeprefix("/").partition("/")
    given = given.partition("?")[0]
    if not secrets.compare_digest(given.encode(errors="replace"), token.encode()):
        return connection.respond(HTTPStatus.FORBIDDEN, "not the address of the view\n")
    request.path = f"/{rest}"
    return answer(connection, request)


async def _handled(handler: Any, connection: Any) -> None:
    """Serve a page; a message that cannot be read ends it with a line in the log."""
    asyncio.get_running_loop().set_exception_handler(
        lambda _, context: _refused(context.get("exception") or context["message"])
    )
    try:
        await handler(connection)
    except Exception as error:
        _refused(error)
        await connection.close(1003, "a message that cannot be read")


def _refused(why: Any) -> None:
    _LOG.warning("view: a message that cannot be read: %s", printable(repr(why)[:200]))
