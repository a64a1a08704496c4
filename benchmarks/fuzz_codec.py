"""Coverage-guided fuzzing of the codec and of a worker's listener.

    pip install -e '.[fuzz]'
    python -m benchmarks.fuzz_codec --seconds 600

Bytes are split into parts and decoded as a peer's would be. A `ProtocolError` is the right answer to garbage; any
other exception is a finding, and so is a message that changes when it is encoded and decoded again. The corpus is kept
in the cache, so that the next run continues from it.
"""

import argparse
import contextlib
import logging
import random
import re
import struct
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

import atheris  # pyright: ignore[reportMissingImports]
import zmq
from rich.console import Console

_CHILD = "--child"
_watched = atheris.instrument_imports if _CHILD in sys.argv else contextlib.nullcontext  # pyright: ignore

with _watched(["protocol"]):
    import msgspec

    from benchmarks.machine import machine_kind
    from protocol.array_part import Part
    from protocol.artifact import cache_directory
    from protocol.catalogue import Message
    from protocol.codec import decode, decode_header, encode, open_envelope, seal
    from protocol.errors import ProtocolError
    from protocol.header import ReplyHeader, RequestHeader
    from protocol.limits import Limits
    from protocol.messages import MESSAGE_NUMBERS, Role, State
    from protocol.server.listener import Listener
    from protocol.timeouts import DEFAULT_TIMEOUTS
    from protocol.transport.sockets import Arrival, Context

# Small, so that what is too large is found as well.
LIMITS = Limits(header_bytes=256, body_bytes=4096, array_bytes=4096, message_bytes=8192, queue=4)
LONGEST_INPUT = 16 * 1024
GOLDEN = Path(__file__).parents[1] / "tests" / "protocol" / "golden"
_LENGTH = struct.Struct("<H")


class NotTheSame(Exception):
    """A message that was decoded, encoded and decoded again is another one."""


class FedListener(Listener):
    """A listener that is given its messages instead of reading them from its socket."""

    def feed(self, parts: Sequence[Part]) -> bool:
        """Handle one message; False once it takes no more."""
        self._take(Arrival([b"fuzz", *parts]))
        if self._in_hand == LIMITS.queue:
            self._in_hand -= len(self.jobs.take_all())
        return self._state is not State.DRAINING

    def close(self) -> None:
        """Give its descriptors back; its thread was never started."""
        self._mailbox.close()


class Target:
    """The target of the fuzzer: the codec and a listener, on the same parts."""

    def __init__(self, findings: Path) -> None:
        self._findings = findings
        self._context: Context = zmq.Context()
        self._socket = self._context.socket(zmq.ROUTER)
        # No client is connected: each reply is encoded, handed to the socket and refused there.
        self._socket.set(zmq.ROUTER_MANDATORY, 1)
        self._listener = self._new_listener()

    def __call__(self, data: bytes) -> None:
        """Try one input; write down what should not have happened."""
        parts = split(data)
        try:
            read(parts)
            if not self._listener.feed(parts):
                self._listener.close()
                self._listener = self._new_listener()
        except Exception:
            self._write_down(data, traceback.format_exc())

    def _new_listener(self) -> FedListener:
        return FedListener(
            self._socket, role=Role.RENDER, capabilities={}, handlers=1, timeouts=DEFAULT_TIMEOUTS, limits=LIMITS
        )

    def _write_down(self, data: bytes, story: str) -> None:
        """One file for each line of code that raised."""
        places = re.findall(r'File ".*?", line \d+', story)
        name = sha256("".join(places).encode()).hexdigest()[:16]
        (self._findings / f"{name}.bin").write_bytes(data)
        (self._findings / f"{name}.txt").write_text(story, encoding="utf-8")


def read(parts: Sequence[Part]) -> None:
    """Read a message as both sides do, and write it again."""
    try:
        envelope = open_envelope(parts, LIMITS)
    except ProtocolError:
        return
    with contextlib.suppress(ProtocolError):
        decode_header(envelope.header, RequestHeader)
    with contextlib.suppress(ProtocolError):
        decode_header(envelope.header, ReplyHeader)
    try:
        message = decode(envelope, LIMITS)
    except ProtocolError:
        return
    written = _written(message)
    if _written(decode(open_envelope(written, LIMITS), LIMITS)) != written:
        raise NotTheSame(f"{message}")


def split(data: bytes) -> list[bytes]:
    """Parts: the length of each but the last comes before it, in two bytes."""
    parts: list[bytes] = []
    while len(data) >= _LENGTH.size and len(parts) < LIMITS.parts + 1:
        (length,) = _LENGTH.unpack_from(data)
        parts.append(data[_LENGTH.size : _LENGTH.size + length])
        data = data[_LENGTH.size + length :]
    return parts


def join(parts: Sequence[bytes]) -> bytes:
    """The inverse of `split`."""
    return b"".join(_LENGTH.pack(len(part)) + part for part in parts)


def mutated(data: bytes, longest: int, seed: int) -> bytes:
    """An input of which one part is changed, moved, doubled or dropped; its lengths mostly stay right."""
    choice, parts = random.Random(seed), split(data)
    if not parts or choice.random() < 0.05:
        return atheris.Mutate(data, longest)
    place = choice.randrange(len(parts))
    match choice.randrange(12):
        case 0:
            parts[0] = struct.pack("<HH", 1, choice.choice([*MESSAGE_NUMBERS.values()]))
        case 1:
            parts.insert(place, parts[choice.randrange(len(parts))])
        case 2:
            del parts[place]
        case 3:
            other = choice.randrange(len(parts))
            parts[place], parts[other] = parts[other], parts[place]
        case 4 | 5 if place >= 3:
            parts[place] = bytes(choice.choice((0, 1, len(parts[place]) * 2, len(parts[place]) // 2)))
        case _:
            parts[place] = atheris.Mutate(parts[place], max(1, min(LIMITS.body_bytes + 1, longest)))
    return join(parts)[:longest]


def fuzz(corpus: Path, findings: Path, seconds: int) -> None:
    """Fuzz until the time is over; ends the process."""
    logging.disable()
    arguments = [
        sys.argv[0],
        f"-max_total_time={seconds}",
        f"-max_len={LONGEST_INPUT}",
        f"-artifact_prefix={findings}/",
        "-timeout=20",
        "-print_final_stats=1",
        str(corpus),
    ]
    atheris.Setup(arguments, Target(findings), custom_mutator=mutated)
    atheris.Fuzz()


def plant(corpus: Path) -> None:
    """Begin with every message that a version ever wrote."""
    corpus.mkdir(parents=True, exist_ok=True)
    for path in GOLDEN.glob("v*/*.bin"):
        parts = msgspec.msgpack.decode(path.read_bytes(), type=list[bytes])
        (corpus / f"{path.parent.name}-{path.stem}").write_bytes(join(parts))


def report(log: str, findings: Path, console: Console) -> int:
    """Print what a run says of itself and what it found; the number of findings."""
    executions = re.search(r"stat::number_of_executed_units:\s*(\d+)", log)
    last = re.findall(r"cov: (\d+) ft: (\d+) corp: (\d+)/", log)
    stories = sorted(findings.glob("*.txt"))
    # Where the interpreter itself ends, libFuzzer leaves the input behind.
    ends = [path for prefix in ("crash", "timeout", "oom", "leak") for path in findings.glob(f"{prefix}-*")]
    console.print(f"machine: {machine_kind()}")
    console.print(f"executions: {executions.group(1) if executions else 'not told'}")
    if last:
        console.print("coverage: {} edges, {} features, {} inputs in the corpus".format(*last[-1]))
    console.print(f"findings: {len(stories) + len(ends)}")
    for path in (*stories, *ends):
        console.print(f"  {path}")
    return len(stories) + len(ends)


def main() -> int:
    """Fuzz in a process of its own, which findings may end, and print the figures; 1 where anything was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz_codec", description=__doc__)
    parser.add_argument("--seconds", type=int, default=600, help="how long (default: %(default)s)")
    parser.add_argument("--folder", type=Path, default=cache_directory() / "fuzz-codec", help="of corpus and findings")
    parser.add_argument(_CHILD, action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    corpus, findings = options.folder / "corpus", options.folder / "findings"
    if options.child:
        fuzz(corpus, findings, options.seconds)
    plant(corpus)
    findings.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "benchmarks.fuzz_codec", _CHILD]
    command += ["--seconds", str(options.seconds), "--folder", str(options.folder)]
    console = Console(soft_wrap=True)
    console.print(f"fuzzing for {options.seconds} s in {options.folder}")
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as log:
        subprocess.run(command, stdout=log, stderr=log, check=False)
        log.seek(0)
        return 1 if report(log.read(), findings, console) else 0


def _written(message: Message) -> list[bytes]:
    header = RequestHeader(1, "fuzz", 1.0)
    return [bytes(part) for part in seal(encode(message, LIMITS), header)]


if __name__ == "__main__":
    sys.exit(main())
