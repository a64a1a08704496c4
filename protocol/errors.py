"""What can go wrong between processes.

VantageError
├── CallFailed            the request got no good answer
│   ├── DeadlineExceeded    none in time
│   ├── WorkerLost          its worker died or was replaced, and no other took it
│   ├── Rejected            the worker answered with a Failure (has .code, .retryable)
│   └── ClientClosed        its client was closed first
├── ProtocolError         what arrived breaks the protocol
│   ├── VersionMismatch     no version that both sides speak
│   ├── WrongRole           the worker at the address serves another role
│   ├── MalformedMessage    it can't be decoded
│   │   └── ImpossibleValue   it can, and a number in it is not finite or out of bounds; told as `invalid-input`
│   └── LimitExceeded       it is larger than what this side takes
├── AddressUnavailable    an address can't be bound or is no address
├── NotPermitted          no key, or not the key for this role
├── InvalidConfig         a configuration names an unknown field or an impossible value
├── InvalidInput          a value handed to us is out of range (a NaN action, an image of the wrong shape)
│   ├── OtherArtifact       a file that something was made with is another one now, or gone
│   └── DamagedRecord       what was written down to go on by lacks something, or can't be read
├── InvalidOutput         a network gave what can't be (NaN, an empty map)
├── ArtifactError         a file that set-up makes (bodies, networks) can't be used
│   ├── ArtifactMissing
│   └── ArtifactDamaged
├── Unavailable           this machine lacks something (EGL, a display driver, an inference provider)
└── Interrupted           the process was asked to stop (Ctrl-C, SIGTERM)
"""


class VantageError(Exception):
    """Root of every error that Vantage raises on purpose."""


class CallFailed(VantageError):
    """A request got no good answer."""


class DeadlineExceeded(CallFailed):
    """No answer came before the call's deadline."""


class WorkerLost(CallFailed):
    """The worker that held the request died or was replaced, and no other took it."""


class Rejected(CallFailed):
    """The worker answered with a `Failure`."""

    def __init__(self, message: str, *, code: str, retryable: bool) -> None:
        super().__init__(message)
        self.code = code
        self.retryable = retryable


class ClientClosed(CallFailed):
    """The client was closed before the answer came, or before the call was made."""


class ProtocolError(VantageError):
    """What arrived breaks the protocol."""


class VersionMismatch(ProtocolError):
    """There is no protocol version that both sides speak."""


class WrongRole(ProtocolError):
    """The worker at an address serves another role than the one that was asked for."""


class MalformedMessage(ProtocolError):
    """A message can't be decoded."""


class ImpossibleValue(MalformedMessage):
    """A message can be decoded, and a value in it breaks its field's bounds; its sender is told `invalid-input`."""


class LimitExceeded(ProtocolError):
    """A message is larger than what this side takes."""


class AddressUnavailable(VantageError):
    """An address can't be bound (it is in use) or is no address."""


class NotPermitted(VantageError):
    """No key, or not the key for this role."""


class InvalidConfig(VantageError):
    """A configuration names an unknown field or an impossible value."""


class InvalidInput(VantageError):
    """A value handed to us is out of range, such as a NaN action or an image of the wrong shape."""


class OtherArtifact(InvalidInput):
    """A file that something was made with is another one now, or gone; with another it is not gone on with."""


class DamagedRecord(InvalidInput):
    """What was written down to go on by lacks something, or can't be read; the message names the file."""


class InvalidOutput(VantageError):
    """A network gave what can't be, such as a heatmap with NaN: it, or how it is run, is broken."""


class ArtifactError(VantageError):
    """A file that set-up makes (bodies, networks) can't be used."""


class ArtifactMissing(ArtifactError):
    """The file is not there; the message says which command makes it."""


class ArtifactDamaged(ArtifactError):
    """The file is there and is not what it should be (truncated, a wrong checksum)."""


class Unavailable(VantageError):
    """This machine lacks something, such as EGL or an inference provider."""


class Interrupted(VantageError):
    """The process was asked to stop; what was under way has been brought to a clean end."""
