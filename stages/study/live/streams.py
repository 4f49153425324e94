"""Poses out of live while it runs: JSON lines on standard output, the same as datagrams, or OSC messages."""

from __future__ import annotations

import json
import os
import queue
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

from ....pipeline.core.errors import InputError
from ....pipeline.core.extras import needed_for
from ....pipeline.core.messages import how_many, say
from .frames import LivePose

_EXPECTED = "Expected --stream -, udp://HOST:PORT or osc://HOST:PORT"
_WAITING = 64  # lines for a program that reads slowly: 2 s
_END_S = 2.0  # that it gets for the last ones

Send = Callable[[LivePose], None]


@contextmanager
def streaming(address: str | None) -> Iterator[Send]:
    """A callback that sends a pose to where the user asked, and does not wait. address: "-", "udp://HOST:PORT",
    "osc://HOST:PORT", or None for nowhere.

    A receiver that is gone is told of once, and nothing else changes. InputError for an address that cannot be, and
    where osc:// needs a package that is not installed.
    """
    if address is None:
        yield lambda pose: None
        return
    if address == "-":
        if sys.stdout is None:
            raise InputError("not-reached", f"{_EXPECTED}, got '-', but standard output is closed.")
        lines = _Lines(sys.stdout.fileno())
        try:
            yield lambda pose: lines.put(as_json(pose))
        finally:
            lines.close()
        return
    scheme, host, port = _parsed(address)
    encode = as_json if scheme == "udp" else _as_osc()
    with _connected(host, port, address) as receiver:
        told = False

        def send(pose: LivePose) -> None:
            nonlocal told
            try:
                receiver.send(encode(pose))
            except BlockingIOError:  # no room; the next pose is newer
                pass
            except OSError as error:  # the next one is tried again, for a receiver may come back
                if not told:
                    told = True
                    say(
                        "warning",
                        f"{address} cannot be reached ({error.strerror}); live goes on and keeps sending.",
                    )

        yield send


def as_json(pose: LivePose) -> bytes:
    """One object and a line's end."""
    return json.dumps(pose.as_dict(), allow_nan=False, separators=(",", ":")).encode() + b"\n"


def _as_osc() -> Callable[[LivePose], bytes]:
    with needed_for("--stream osc://", "osc"):
        import pythonosc  # noqa: F401
    from .vmc import Performer

    return Performer().bundle


def _parsed(address: str) -> tuple[str, str, int]:
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise InputError("bad-value", f"{_EXPECTED}, got '{address}': {error}.") from None
    more = parts.netloc.count("@") or parts.path not in ("", "/") or parts.query or parts.fragment
    if parts.scheme not in ("udp", "osc") or more:
        raise InputError("bad-value", f"{_EXPECTED}, got '{address}'.")
    if not host or not port:
        raise InputError("bad-value", f"{_EXPECTED}, with a host and a port of 1 to 65535; got '{address}'.")
    return parts.scheme, host, port


@contextmanager
def _connected(host: str, port: int, address: str) -> Iterator[socket.socket]:
    """A socket that sends there and nowhere else, and hears when nobody listens."""
    try:
        family, kind, protocol, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        receiver = socket.socket(family, kind, protocol)
    except (OSError, UnicodeError) as error:
        raise InputError(
            "not-reached", f"{_EXPECTED} of a host that is known, got '{address}': {error}."
        ) from None
    with receiver:
        try:
            receiver.connect(place)
        except OSError as error:
            raise InputError("not-reached", f"{address} cannot be sent to: {error.strerror}.") from None
        receiver.setblocking(False)
        yield receiver


class _Lines:
    """Lines into a pipe by a thread of its own, so that a program that reads slowly, or has ended, stops nobody."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._waiting: queue.Queue[bytes | None] = queue.Queue(_WAITING)
        self._gone = threading.Event()
        self._lost = 0
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    def put(self, line: bytes) -> None:
        if self._gone.is_set():
            return
        try:
            self._waiting.put_nowait(line)
        except queue.Full:
            if not self._lost:
                say("warning", "standard output is read too slowly: poses are left out of it.")
            self._lost += 1

    def close(self) -> None:
        try:
            self._waiting.put(None, timeout=_END_S)
            self._thread.join(_END_S)
        except queue.Full:
            pass
        if self._lost:
            say(
                "live",
                f"{how_many(self._lost, 'pose')} left out of standard output, which was read too slowly",
            )

    def _write(self) -> None:
        while (line := self._waiting.get()) is not None:
            try:
                while line:  # past Python's own buffer, whose lock a writer that waits would keep for good
                    line = line[os.write(self._descriptor, line) :]
            except OSError as error:
                self._gone.set()
                say("warning", f"standard output is closed ({error.strerror}); live goes on without it.")
                return
