"""An eavesdropper between client and worker, who reads every byte."""

import contextlib
import socket
import threading
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def relay(address: str, heard: list[bytes]) -> Generator[str]:
    """Pass on one connection to a worker's address; gives the address to connect to instead."""
    host, port = address.removeprefix("tcp://").split(":")
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection((host, int(port))) as worker:

        def carry() -> None:
            with contextlib.suppress(OSError), server.accept()[0] as client:
                back = threading.Thread(target=_pass_on, args=(worker, client, heard), daemon=True)
                back.start()
                _pass_on(client, worker, heard)
                worker.shutdown(socket.SHUT_RDWR)
                back.join()

        thread = threading.Thread(target=carry, daemon=True)
        thread.start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        thread.join()


def _pass_on(source: socket.socket, target: socket.socket, heard: list[bytes]) -> None:
    with contextlib.suppress(OSError):
        while piece := source.recv(65536):
            heard.append(piece)
            target.sendall(piece)
