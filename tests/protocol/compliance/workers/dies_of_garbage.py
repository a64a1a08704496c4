"""Takes for granted that what comes is a message; only for another version is it prepared, and for large ones."""

from proper_worker import ProperWorker, run

from protocol.errors import MalformedMessage


class DiesOfGarbage(ProperWorker):
    def refuse(self, sender, parts, error) -> None:
        if isinstance(error, MalformedMessage):
            raise error
        super().refuse(sender, parts, error)


run(DiesOfGarbage)
