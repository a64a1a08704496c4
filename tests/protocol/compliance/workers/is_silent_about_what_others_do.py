"""Lets clients that have the wrong address wait for what it will never answer."""

from proper_worker import ProperWorker, run

from protocol.messages import Lookup, Register


class IsSilentAboutWhatOthersDo(ProperWorker):
    def answer(self, sender, header, message) -> None:
        if not isinstance(message, Lookup | Register):
            super().answer(sender, header, message)


run(IsSilentAboutWhatOthersDo)
