"""Somebody on the same network who tries all that they can think of: `intruder.py FOLDER NAME=ADDRESS...`.

The folder has stolen keys, and a key of their own making. Prints a JSON list with what came of each attempt.
"""

import json
import socket
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import zmq

from protocol import Pool, Timeouts
from protocol.errors import CallFailed, NotPermitted, Rejected
from protocol.message import Request
from protocol.messages import (
    Dismiss,
    Drain,
    Hello,
    Lookup,
    Observe,
    Ping,
    Register,
    Render,
    Role,
    SampleScene,
    State,
    WorkerRecord,
)
from protocol.pose_estimate import FilterState
from protocol.security import Security, load_credentials
from protocol.security.allow_list import read_allow_list
from tests.protocol.processes.bare_client import bare_client
from tests.protocol.values.samples import CAMERA, SCENE

PATIENCE = 0.7
HASTY = Timeouts(call=PATIENCE, startup=PATIENCE, heartbeat=0.1)
ZMTP_GREETING = 64
"""Bytes that ZeroMQ itself says to whoever connects, before it knows anything of them."""
RECORD = WorkerRecord(role=Role.AGENT, address="", incarnation="x", state=State.READY)
WISHES: dict[str, tuple[Request, ...]] = {
    "render": (SampleScene(seed=1, split="train"), Render(scene=SCENE, camera=CAMERA)),
    "perception": (Observe(scene=SCENE, camera=CAMERA, filter=FilterState.initial()), Ping()),
    "orchestrator": (Lookup(role=Role.RENDER), Register(worker=RECORD), Dismiss(incarnation="x")),
}
NOISE = {
    "http": b"GET /metrics HTTP/1.1\r\n\r\n",
    "zeros": bytes(4096),
    "greeting": b"\xff" + bytes(8) + b"\x7f\x03" * 99,
}


def attempts(folder: Path, target: str, address: str) -> Iterator[tuple[str, bool]]:
    """What was tried, and whether it was answered."""
    general = (Hello(role=Role.AGENT, incarnation="x"), Ping(), Drain())
    for request in (*general, *WISHES[target]):
        yield f"no key, {type(request).__name__}", _answered_without_key(address, request)
    for name, noise in NOISE.items():
        yield f"bare bytes, {name}", _answered_bare(address, noise)
    for role in Role:
        made_up = folder / "made-up" / role
        yield f"own key as {role}", _answered(made_up, f"made-up-{role}", target, address, Ping())
    stolen = folder / "stolen"
    for request in (Ping(), *WISHES[target]):
        yield f"revoked key, {type(request).__name__}", _answered(stolen, "revoked", target, address, request)
    wrong = "perception" if target == "perception" else "render"
    for request in (Ping(), *WISHES[target]):
        # Every role has business with the orchestrator: there it is what they say that is refused.
        if target != "orchestrator" or isinstance(request, Register | Dismiss):
            yield f"{wrong} key, {type(request).__name__}", _answered(stolen, wrong, target, address, request)


def _answered_without_key(address: str, request: Request) -> bool:
    with bare_client(address) as bare:
        bare.ask(request)
        return bare.has_reply(PATIENCE)


def _answered_bare(address: str, noise: bytes) -> bool:
    host, port = address.removeprefix("tcp://").split(":")
    heard = b""
    with socket.create_connection((host, int(port)), timeout=PATIENCE) as connection, suppress(OSError):
        connection.sendall(noise)
        while piece := connection.recv(4096):
            heard += piece
    return len(heard) > ZMTP_GREETING


def _answered(folder: Path, key: str, target: str, address: str, request: Request) -> bool:
    security = Security(credentials := load_credentials(folder / f"{key}.key"))
    true_key = next(known.public for known in read_allow_list(folder / "allowed.json").keys if known.name == target)
    with Pool([], role=credentials.own.role, serves=Role(target), timeouts=HASTY, security=security) as pool:
        pool.add(address, true_key)
        try:
            pool.call(request)
        except Rejected as refusal:
            return refusal.code != "not-permitted"
        except (NotPermitted, CallFailed):
            return False
    return True


def main() -> None:
    folder = Path(sys.argv[1])
    found = [
        {"target": target, "attempt": attempt, "answered": answered}
        for target, address in (word.split("=", 1) for word in sys.argv[2:])
        for attempt, answered in attempts(folder, target, address)
    ]
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    assert zmq.has("curve")
    main()
