"""A proxy of TCP between clients and a server."""

from __future__ import annotations

import socket
import threading
import time


class Proxy:
    """Connections to a server. Each can be muted, so that nobody reads it and nobody closes it, or be broken off.

    All of them can be read slowly.
    """

    def __init__(self, port):
        self.lead_to(port)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self.listener.getsockname()[1]}"
        self.muted, self.clients, self.is_slow = [], [], threading.Event()
        threading.Thread(target=self.accept, daemon=True).start()

    def lead_to(self, port):
        """From now on, whoever connects."""
        self.to = ("127.0.0.1", port)

    def break_off(self, number):
        self.clients[number].shutdown(socket.SHUT_RDWR)

    def accept(self):
        while True:
            try:
                client = self.listener.accept()[0]
            except OSError:
                return
            server, mute = socket.socket(), threading.Event()
            # By itself the system would take in 32 MiB that nobody reads. Where its buffer is short instead it drops
            # packets, and with them word of what has arrived: nothing would reach the server either.
            server.setsockopt(socket.IPPROTO_TCP, socket.TCP_WINDOW_CLAMP, 1 << 16)
            try:
                server.connect(self.to)
            except OSError:
                client.close()
                server.close()
                continue
            self.muted.append(mute)
            self.clients.append(client)
            for pump in ((client, server, mute, False), (server, client, mute, True)):
                threading.Thread(target=self.pump, args=pump, daemon=True).start()

    def pump(self, source, sink, mute, is_muted):
        def wait():
            while mute.is_set():
                time.sleep(0.05)

        try:
            while some := source.recv(1 << 16):
                if is_muted:
                    wait()
                if is_muted and self.is_slow.is_set():
                    time.sleep(0.1)
                sink.sendall(some)
        except OSError:
            pass
        # Nor does the server hear that the client is gone.
        wait()
        for end in (source, sink):
            end.close()
