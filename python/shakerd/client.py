"""The daemon's stream of JSON documents, and its commands (docs/protocol.md)."""
from __future__ import annotations

import json
import os
import pathlib
import socket
import time
from typing import Any, Iterator, Mapping, Optional, Union

Document = dict[str, Any]
PathLike = Union[str, "os.PathLike[str]"]

DEFAULT_SOCKET = "/run/shakerd/shakerd.sock"
RENEW_S = 0.5  # a quarter of the shortest lease that a rig file has by default
LINE_MAX = 64 * 1024  # bytes: the daemon throws a longer request away


class Refused(RuntimeError):
    """The daemon did not do what was asked. `code` is the JSON-RPC code of docs/protocol.md."""

    def __init__(self, code: int, sentence: str) -> None:
        super().__init__(sentence)
        self.code = code


class ConnectionLost(ConnectionError):
    """The daemon has gone, or has closed the connection because this client read too slowly."""


def connect(path: Optional[PathLike] = None, timeout: float = 5.0) -> Client:
    """Opens the daemon's socket: `path`, else $SHAKERD_SOCKET, else the installed service's.

    Raises ConnectionLost when nobody listens there, and PermissionError when this user may not
    connect (members of the group `shaker` may).
    """
    return Client(path or os.environ.get("SHAKERD_SOCKET", DEFAULT_SOCKET), timeout)


class Client:
    """One connection. Not for several threads at once.

    `version` is the first document: program, protocol, rig. The snapshot that follows (the last
    state and estimate, alarms of the start) comes out of `documents` first.
    """

    def __init__(self, path: PathLike, timeout: float = 5.0) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._rest = b""
        self._waiting: list[Document] = []  # documents that came while an answer was awaited
        self._next_id = 0
        self._timeout = timeout
        try:
            self._socket.connect(os.fspath(path))
        except (FileNotFoundError, ConnectionRefusedError) as trouble:
            self._socket.close()
            raise ConnectionLost(f"no daemon listens at {os.fspath(path)}: is shakerd running?") from trouble
        except OSError:
            self._socket.close()
            raise
        first = self._next(timeout)
        if first is None or first.get("type") != "version":
            self.close()
            raise ConnectionLost(f"{os.fspath(path)}: no shakerd answers there within {timeout:g} s")
        self.version: Document = first

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """A client in control that leaves makes the rig ramp down."""
        self._socket.close()

    # --- the stream

    def documents(self, timeout: Optional[float] = None) -> Iterator[Document]:
        """Every document as it is published; ends when none has come for `timeout` s (None: never)."""
        while (document := self._document(timeout)) is not None:
            yield document

    # --- commands

    def ask(self, method: str, params: Optional[Mapping[str, Any]] = None) -> Any:
        """The result of a command. Raises Refused with the daemon's sentence."""
        self._next_id += 1
        request: Document = {"jsonrpc": "2.0", "id": self._next_id, "method": method}
        if params is not None:
            request["params"] = params
        self._send(request)
        end = time.monotonic() + self._timeout
        while (left := end - time.monotonic()) > 0.0:
            document = self._next(left)
            if document is None:
                break
            if document.get("jsonrpc") != "2.0":
                self._waiting.append(document)
            elif document.get("id") == self._next_id:
                if "error" in document:
                    raise Refused(document["error"]["code"], document["error"]["message"])
                return document["result"]
        raise ConnectionLost(f"the daemon has not answered {method} within {self._timeout:g} s")

    def status(self) -> Document:
        """The state as it is now, and who is in control."""
        return self.ask("status")

    def stop(self) -> Document:
        """Ramps down, whoever is in control."""
        return self.ask("stop")

    def pause(self) -> Document:
        """Ramps to rest and keeps the campaign open. `resume` goes on, by the client in control."""
        return self.ask("pause")

    def resume(self) -> Document:
        """Goes on with a paused campaign. Raises Refused unless this client is in control."""
        return self.ask("resume")

    def emergency_stop(self) -> Document:
        """Zero at once; latches FAULT until `acknowledge`."""
        return self.ask("estop")

    def acknowledge(self) -> Document:
        """Acknowledges the alarms, and a fault whose cause is gone."""
        return self.ask("ack")

    def run(self, campaign: Union[PathLike, Mapping[str, Any]]) -> Iterator[Document]:
        """Starts a campaign (a file, or what one holds) and yields its documents until the rig rests.

        The lease is renewed while the caller takes documents: a caller that dies, hangs or leaves the
        loop makes the rig ramp down within the lease of the rig file (2 s by default). A loop body must
        therefore be quick. Raises Refused where the daemon does not start it.
        """
        if not isinstance(campaign, Mapping):
            campaign = json.loads(pathlib.Path(campaign).read_text(encoding="utf-8"))
        self.ask("control.acquire")
        moved = False
        try:
            self.ask("campaign.start", {"campaign": campaign})
            renewed = 0.0
            while True:
                if time.monotonic() - renewed > RENEW_S:
                    self._send({"jsonrpc": "2.0", "method": "lease.renew"})
                    renewed = time.monotonic()
                document = self._document(RENEW_S / 2)
                if document is None:
                    continue
                yield document
                if document["type"] == "state":
                    rests = document["state"] in ("IDLE", "FAULT")
                    if rests and moved:
                        return
                    moved = moved or not rests
        finally:
            try:
                self._send({"jsonrpc": "2.0", "method": "control.release"})
            except OSError:
                pass  # the connection is gone, and the lease with it

    # --- lines

    def _send(self, request: Document) -> None:
        line = json.dumps(request).encode() + b"\n"
        if len(line) > LINE_MAX:
            raise ValueError(f"a request of {len(line)} bytes; the daemon reads at most {LINE_MAX}")
        self._socket.settimeout(self._timeout)
        try:
            self._socket.sendall(line)
        except (BrokenPipeError, ConnectionResetError) as trouble:
            raise ConnectionLost("the daemon has closed the connection") from trouble

    def _document(self, timeout: Optional[float]) -> Optional[Document]:
        if self._waiting:
            return self._waiting.pop(0)
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            document = self._next(None if end is None else max(0.0, end - time.monotonic()))
            if document is None or document.get("jsonrpc") != "2.0":
                return document

    def _next(self, timeout: Optional[float]) -> Optional[Document]:
        """The next line; None when `timeout` s have passed."""
        end = None if timeout is None else time.monotonic() + timeout
        while b"\n" not in self._rest:
            # A timeout of 0 would mean: do not block.
            self._socket.settimeout(None if end is None else max(1e-3, end - time.monotonic()))
            try:
                data = self._socket.recv(1 << 16)
            except TimeoutError:
                return None
            except ConnectionResetError:
                data = b""
            if not data:
                raise ConnectionLost("the daemon has closed the connection")
            self._rest += data
        line, self._rest = self._rest.split(b"\n", 1)
        document: Document = json.loads(line)
        if document.get("type") == "missed":
            raise ConnectionLost(f"this client read too slowly: {document['count']} documents were missed")
        return document
