"""A proxy on the daemon's wire to the rig that understands Modbus frames, and can lie about them.

What it does to an exchange is a list of rules, asked in order; without one it passes everything on.
"""
import contextlib
import socket
import threading
import time

import modbus_wire as modbus


class Rule:
    """Overridden where it interferes. None as a request or an answer: it goes no further."""

    def request(self, request):
        return request

    def reply(self, request):
        """An answer that the rig is not asked for; None: it is asked."""
        return None

    def answer(self, request, answer):
        return answer

    def octets(self, request, answer):
        """What goes onto the wire."""
        return answer.encode()


class Proxy(threading.Thread):
    def __init__(self, rig_port):
        super().__init__(daemon=True)
        self.rig_port = rig_port
        self.rules = ()
        self.links = set()
        self.lock = threading.Lock()
        self.ended = False
        self.accepting = True
        self.listener = socket.create_server(("127.0.0.1", 0), backlog=16)
        self.port = self.listener.getsockname()[1]
        self.start()

    def add(self, rule):
        self.rules = (*self.rules, rule)

        def remove():
            self.rules = tuple(r for r in self.rules if r is not rule)
        return remove

    def run(self):
        while not self.ended:
            try:
                link, _ = self.listener.accept()
            except OSError:
                return
            if not self.accepting:
                reset(link)
                continue
            threading.Thread(target=self.serve, args=(link,), daemon=True).start()

    def reset_all(self):
        """RST on every connection."""
        with self.lock:
            links = list(self.links)
        for link in links:
            reset(link)

    def end(self):
        self.ended = True
        with contextlib.suppress(OSError):
            self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        self.reset_all()

    def serve(self, link):
        with self.lock:
            self.links.add(link)
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        rig = None
        try:
            while (request := modbus.receive(link)) is not None:
                rig = rig or self.dial()
                answer = self.exchange(request, rig)
                if answer:
                    link.sendall(answer)
        except OSError:
            pass  # either side has gone, which is what a proxy is for
        finally:
            with self.lock:
                self.links.discard(link)
            link.close()
            if rig:
                rig.close()

    def dial(self):
        rig = socket.create_connection(("127.0.0.1", self.rig_port), 1.0)
        rig.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return rig

    def exchange(self, request, rig):
        rules = self.rules
        answer, forwarded = None, request
        for rule in rules:
            forwarded = rule.request(forwarded)
            if forwarded is None:
                return None
            answer = rule.reply(forwarded)
            if answer is not None:
                break
        if answer is None:
            rig.sendall(forwarded.encode())
            answer = self.answer_to(forwarded, rig)
        for rule in rules:
            if answer is None:
                return None
            answer = rule.answer(request, answer)
        if answer is None:
            return None
        octets = answer.encode()
        for rule in rules:
            changed = rule.octets(request, answer)
            octets = octets if changed == answer.encode() else changed
        return octets

    def answer_to(self, request, rig):
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            try:
                answer = modbus.receive(rig)
            except TimeoutError:
                return None  # a rig that is silent: so is the wire
            if answer is None:
                raise ConnectionError("the rig has hung up")
            if answer.transaction == request.transaction:
                return answer
        return None


def reset(link):
    with contextlib.suppress(OSError):
        link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
        # A thread may still wait in recv: only a shutdown wakes it, and the close after it resets.
        link.shutdown(socket.SHUT_RD)
