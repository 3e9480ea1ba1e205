"""Where an engine is: tcp://host:port, and a socket to it."""
from __future__ import annotations

import ipaddress
import math
import select
import socket
import time
from urllib.parse import urlsplit

from .errors import ConnectionLost, ConsacError, said


def parse_url(url: str) -> tuple[str, int]:
    """Host and port of `tcp://host:port`."""
    try:
        parts = urlsplit(url if "://" in url else f"tcp://{url}")
        host, port = parts.hostname, parts.port
    except (TypeError, ValueError):
        raise ConsacError(f"{url!r} is no engine's address; write tcp://host:port") from None
    if parts.scheme != "tcp" or not host or not port or parts.path not in ("", "/"):
        raise ConsacError(f"{url!r} is no engine's address; write tcp://host:port")
    return host, port


def open_socket(host: str, port: int, timeout: float, wait: float = 0.0) -> socket.socket:
    """A connected socket; a port that refuses is tried again for `wait` seconds."""
    end = time.monotonic() + wait
    while True:
        try:
            sock = socket.create_connection((host, port), timeout)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return sock
        except OSError as error:
            if time.monotonic() >= end:
                raise ConnectionLost(f"no engine answers at {host}:{port} ({said(error)}); start it first, or check the address") from error
        time.sleep(0.05)


def ready(sock: socket.socket, seconds: float, write: bool = False) -> bool:
    """Whether `sock` can be read from, or written to, within `seconds`; OSError or ValueError where it is closed."""
    if not hasattr(select, "poll"):  # Windows, whose select() takes descriptors of any number
        return any(select.select([] if write else [sock], [sock] if write else [], [], seconds))
    poll = select.poll()
    poll.register(sock, select.POLLOUT if write else select.POLLIN)
    return bool(poll.poll(math.ceil(1000 * seconds)))


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach `host`, a name or an address."""
    try:
        return host == "localhost" or ipaddress.ip_address(host.removeprefix("::ffff:")).is_loopback
    except ValueError:
        return False


def peer_of(sock: socket.socket) -> str:
    """Who is at the other end, for people: "127.0.0.1:5005"."""
    try:
        host, port = sock.getpeername()[:2]
        return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
    except OSError:
        return "somebody who has left"


def is_here(sock: socket.socket) -> bool:
    """Whether the peer of a connected socket is on this machine."""
    try:
        return is_loopback(sock.getpeername()[0])
    except OSError:
        return False
