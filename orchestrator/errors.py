"""What can go wrong around a run, beside what goes wrong on the wire.

VantageError
├── RunError              a run directory can't be used as asked
│   ├── RunExists           it is there already; a run is never overwritten
│   ├── NoSuchRun           it is not there, or is no run
│   ├── RunBusy             another orchestrator works on it
│   ├── RunNotWritable      nothing can be written to it
│   └── NoLocks             its file system has none
├── ProcessFailed         a process of the run ended by itself and should not have
│   └── RestartsExhausted   it did so more often than it may be started again
├── HostLost              the host that a run has joined is gone for too long
├── HostNotTold           the run is done, and its host could not be told
└── OutputLost            what a command printed was not taken
"""

from protocol.errors import VantageError


class RunError(VantageError):
    """A run directory can't be used as asked."""


class RunExists(RunError):
    """The directory is there already; a run is never overwritten."""


class NoSuchRun(RunError):
    """There is no run at this path."""


class RunBusy(RunError):
    """Another orchestrator works on this run."""


class RunNotWritable(RunError):
    """Nothing can be written to the run."""


class NoLocks(RunError):
    """The file system has no locks, so that nobody would know that another works there."""


class ProcessFailed(VantageError):
    """A process of the run ended by itself and should not have."""


class RestartsExhausted(ProcessFailed):
    """A process of the run failed more often than it may be started again."""


class HostLost(VantageError):
    """The host that a run has joined is gone for too long; its workers end as well."""


class HostNotTold(VantageError):
    """The run is done, and the host that it had joined could not be told; its workers stay."""


class OutputLost(VantageError):
    """What a command had to print was not taken: the disk is full, or whoever read it is gone."""
