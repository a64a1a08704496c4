"""A worker written after docs/protocol.md, without our server: pings from one thread, work in another.

The programs beside this one are the same worker but for one thing, which they are named for. Each is started with an
address; as a program of its own this one does everything right.
"""

import os
import queue
import secrets
import sys
import threading
import time
from dataclasses import dataclass

import numpy as np
import zmq

from protocol.catalogue import Message
from protocol.codec import decode, decode_header, encode, open_envelope, seal
from protocol.errors import ProtocolError
from protocol.failure import draining, failure_of, overloaded
from protocol.frame import Frame
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Reply, Request
from protocol.messages import (
    PROTOCOL_VERSION,
    Drain,
    Drained,
    Failure,
    Hello,
    Ping,
    Pong,
    Render,
    Role,
    Sampled,
    SampleScene,
    State,
    Welcome,
)
from protocol.scene import Arm, BodyPose, Scene, Sun

LIMITS = Limits()
DRAWING = 0.01
"""Seconds that a picture takes."""


@dataclass
class Job:
    """A request in hand."""

    sender: bytes
    number: int
    request: Request
    expires: float


class ProperWorker:
    """A ROUTER that the main thread reads, and a pair of sockets through which the handler's replies come back."""

    incarnation = secrets.token_hex(8)

    def __init__(self, address: str) -> None:
        context = zmq.Context()
        self.router = context.socket(zmq.ROUTER)
        self.router.set(zmq.MAXMSGSIZE, LIMITS.part_bytes)
        self.router.bind(address)
        self.replies, self.handler = context.socket(zmq.PAIR), context.socket(zmq.PAIR)
        self.replies.bind("inproc://replies")
        self.handler.connect("inproc://replies")
        self.jobs: queue.SimpleQueue[Job] = queue.SimpleQueue()
        self.in_hand = self.progress = self.malformed = 0
        self.drainers: list[tuple[bytes, int]] = []
        threading.Thread(target=self.handle_all, daemon=True).start()

    def run(self) -> None:
        """Until drained."""
        poller = zmq.Poller()
        poller.register(self.router, zmq.POLLIN)
        poller.register(self.replies, zmq.POLLIN)
        while not self.drainers or self.in_hand:
            ready = dict(poller.poll())
            if self.replies in ready:
                self.in_hand -= 1
                self.progress += 1
                self.router.send_multipart(self.replies.recv_multipart())
            if self.router in ready:
                self.take(*self.router.recv_multipart())
        for sender, number in self.drainers:
            self.reply(sender, number, Drained())
        self.router.close(linger=1000)

    def take(self, sender: bytes, *parts: bytes) -> None:
        """Answer or queue what came."""
        try:
            message, header = self.read(parts)
        except ProtocolError as error:
            self.malformed += 1
            self.refuse(sender, parts, error)
        else:
            self.answer(sender, header, message)

    def read(self, parts: tuple[bytes, ...]) -> tuple[Message, RequestHeader]:
        """The message, and its header."""
        envelope = open_envelope(parts, LIMITS)
        header = decode_header(envelope.header, RequestHeader)
        return decode(envelope, LIMITS), header

    def refuse(self, sender: bytes, parts: tuple[bytes, ...], error: ProtocolError) -> None:
        """Tell the sender, if its header can be read."""
        try:
            number = decode_header(parts[1], RequestHeader).request
        except (ProtocolError, IndexError):
            return
        self.reply(sender, number, self.told(error))

    def told(self, error: ProtocolError) -> Reply:
        """What the sender of a message that can't be taken is told."""
        return failure_of(error)

    def answer(self, sender: bytes, header: RequestHeader, message: Message) -> None:
        """What needs no computing at once; the rest goes to the handler."""
        match message:
            case Hello():
                self.reply(sender, header.request, self.greet(message))
            case Ping():
                self.reply(sender, header.request, self.health())
            case Drain():
                self.drainers.append((sender, header.request))
            case Render() | SampleScene():
                self.queue(Job(sender, header.request, message, time.monotonic() + header.deadline))
            case _:
                self.reply(sender, header.request, Failure(code="unsupported", message="I draw"))

    def greet(self, hello: Hello) -> Reply:
        """Agree on a version."""
        if not hello.oldest_version <= PROTOCOL_VERSION <= hello.newest_version:
            return Failure(code="version-mismatch", message=f"I speak version {PROTOCOL_VERSION}")
        return Welcome(version=PROTOCOL_VERSION, role=Role.RENDER, incarnation=self.incarnation, heartbeat=0.5)

    def health(self) -> Pong:
        """How I am."""
        idle = State.BUSY if self.in_hand else State.READY
        return Pong(
            incarnation=self.incarnation,
            state=State.DRAINING if self.drainers else idle,
            progress=self.progress,
            queue_depth=self.in_hand,
            resident_bytes=os.sysconf("SC_PAGE_SIZE"),
            malformed=self.malformed,
        )

    def queue(self, job: Job) -> None:
        """Take a request in hand, unless I end or have enough."""
        if self.drainers:
            self.reply(job.sender, job.number, draining())
        elif self.in_hand >= LIMITS.queue:
            self.reply(job.sender, job.number, overloaded(self.in_hand))
        else:
            self.in_hand += 1
            self.jobs.put(job)

    def handle_all(self) -> None:
        """The handler's thread."""
        while True:
            job = self.jobs.get()
            reply = self.refuse_late(job) or self.compute(job.request)
            self.handler.send_multipart([job.sender, *self.sealed(job.number, reply)])

    def refuse_late(self, job: Job) -> Failure | None:
        """What is past its deadline is not computed."""
        late = Failure(code="deadline-exceeded", message="its deadline passed in my queue")
        return late if time.monotonic() >= job.expires else None

    def compute(self, request: Request) -> Reply:
        """A black picture, or a scene."""
        if not isinstance(request, Render):
            return Sampled(scene=SCENE)
        time.sleep(DRAWING)
        size = request.camera.intrinsics.height, request.camera.intrinsics.width
        return Frame(rgb=np.zeros((*size, 3), np.uint8), depth=np.ones(size, np.float32), camera=request.camera)

    def reply(self, sender: bytes, number: int, reply: Reply) -> None:
        """Answer from the main thread."""
        self.router.send_multipart([sender, *self.sealed(number, reply)])

    def sealed(self, number: int, reply: Reply) -> list[bytes]:
        """A reply's parts."""
        return [bytes(part) for part in seal(encode(reply, LIMITS), ReplyHeader(number, self.incarnation))]


SCENE = Scene(
    identity=0,
    pose=BodyPose(kind=0, left_arm=Arm((0.0, 0.2, -0.9)), right_arm=Arm((0.0, -0.2, -0.9))),
    appearance=0,
    position=(0.0, 0.0),
    yaw=0.0,
    sun=Sun(0.0, 1.0),
    ground="grass",
    background="sky-clear",
)


def run(kind: type[ProperWorker]) -> None:
    """Serve at the address on the command line."""
    kind(sys.argv[1]).run()


if __name__ == "__main__":
    run(ProperWorker)
