"""Answers every request with garbage: noise, then a reply whose body is noise."""

import msgspec
from bare_worker import INCARNATION, BareWorker, open_worker

from protocol.header import ReplyHeader


def answer(worker: BareWorker, sender: bytes, number: int, message) -> None:
    header = msgspec.msgpack.encode(ReplyHeader(number, INCARNATION))
    worker.socket.send_multipart([sender, b"\xff" * 40])
    worker.socket.send_multipart([sender, b"\x01\x00\x11\x00", b"noise", b"\x80"])
    worker.socket.send_multipart([sender, b"\x01\x00\x11\x00", header, b"\xc1"])


open_worker().serve(answer)
