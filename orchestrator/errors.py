"""Errors of runs and their processes, besides those of the protocol.

VantageError
├── RunError              a run directory can't be used as asked
│   ├── RunExists           it is there already; a run is never overwritten
│   ├── NoSuchRun           it is not there, or is no run
│   ├── RunBusy             another orchestrator works on it
│   ├── RunNotWritable      nothing can be written to it
│   └── NoLocks             its file system has none
├── ProcessFailed         a process of the run ended by itself and should not have
│   └── RestartsExhausted   it did so more often than it may be started again
├── HostLost              the host that a run has joined was unreachable for too long
├── HostNotTold           the run is done, and its host could not be told
└── OutputLost            the output of a command could not be written
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
    """The file system has no locks, so two orchestrators could work there at once."""


class ProcessFailed(VantageError):
    """A process of the run ended by itself and should not have."""


class RestartsExhausted(ProcessFailed):
    """A process of the run failed more often than it may be started again."""


class HostLost(VantageError):
    """The host that a run has joined was unreachable for too long; its workers end as well."""


class HostNotTold(VantageError):
    """The run is done, and the host that it had joined could not be told; the host's workers go on."""


class OutputLost(VantageError):
    """The output of a command could not be written: the disk is full, or the reader is gone."""
