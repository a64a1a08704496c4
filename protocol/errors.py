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
│   │   └── ImpossibleValue   it can, and a number in it is not finite or out of bounds; its code is `invalid-input`
│   └── LimitExceeded       it is larger than what this side takes
├── AddressUnavailable    an address can't be bound or is malformed
├── NotPermitted          no key, or not the key for this role
├── InvalidConfig         a configuration names an unknown field or an impossible value
├── InvalidInput          an argument is out of range (a NaN action, an image of the wrong shape)
│   ├── OtherArtifact       a file that something was made with was changed or removed since
│   └── DamagedRecord       a record that a run needs to resume is incomplete or can't be read
├── InvalidOutput         a network returned an impossible value (NaN, an empty map)
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
    """A message can be decoded, and a value in it is out of its field's bounds; its code is `invalid-input`."""


class LimitExceeded(ProtocolError):
    """A message is larger than what this side takes."""


class AddressUnavailable(VantageError):
    """An address can't be bound (it is in use) or is malformed."""


class NotPermitted(VantageError):
    """No key, or not the key for this role."""


class InvalidConfig(VantageError):
    """A configuration names an unknown field or an impossible value."""


class InvalidInput(VantageError):
    """An argument is out of range, such as a NaN action or an image of the wrong shape."""


class OtherArtifact(InvalidInput):
    """A file that something was made with was changed or removed since, so that can't be continued."""


class DamagedRecord(InvalidInput):
    """A record that a run needs to resume is incomplete or can't be read; the message names the file."""


class InvalidOutput(VantageError):
    """A network returned an impossible value, such as a heatmap with NaN: the network or its runtime is broken."""


class ArtifactError(VantageError):
    """A file that set-up makes (bodies, networks) can't be used."""


class ArtifactMissing(ArtifactError):
    """The file is not there; the message says which command makes it."""


class ArtifactDamaged(ArtifactError):
    """The file is damaged (truncated, a wrong checksum)."""


class Unavailable(VantageError):
    """This machine lacks something, such as EGL or an inference provider."""


class Interrupted(VantageError):
    """The process was asked to stop; what was under way has been brought to a clean end."""
