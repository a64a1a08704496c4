"""What can be wrong with the files of an earlier training.

InvalidInput
└── ResumeRefused         a run can't be resumed; nothing in it was changed
    ├── OtherConfig         its checkpoints are of a training with another configuration
    ├── NewerFormat         a later version of Vantage wrote them
    ├── JournalDamaged      a file that the checkpoint names is missing, cut off, or was written to
    └── NoWholeCheckpoint   there are checkpoints, and all of them are damaged

OSError
└── RunInUse              another process trains in the run directory; it may end
"""

from protocol.errors import InvalidInput


class ResumeRefused(InvalidInput):
    """A run can't be resumed; nothing in it was changed."""


class OtherConfig(ResumeRefused):
    """The checkpoints are of a training with another configuration."""


class NewerFormat(ResumeRefused):
    """A later version of Vantage wrote the checkpoints."""


class JournalDamaged(ResumeRefused):
    """A file that the checkpoint names is missing, cut off, or was written to."""


class NoWholeCheckpoint(ResumeRefused):
    """There are checkpoints, and all of them are damaged."""


class RunInUse(OSError):
    """Another process trains in the run directory; it may end."""
