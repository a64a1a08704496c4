"""Makes up a new name whenever it is asked who it is."""

import secrets

from msgspec.structs import replace
from proper_worker import ProperWorker, run


class IsAnotherInEveryPong(ProperWorker):
    def health(self):
        return replace(super().health(), incarnation=secrets.token_hex(8))


run(IsAnotherInEveryPong)
