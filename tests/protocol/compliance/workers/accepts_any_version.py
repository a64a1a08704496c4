"""Says Welcome to every client, in any version that the client offers."""

from proper_worker import ProperWorker, run

from protocol.messages import Role, Welcome


class AcceptsAnyVersion(ProperWorker):
    def greet(self, hello):
        return Welcome(
            version=min(hello.newest_version, 909), role=Role.RENDER, incarnation=self.incarnation, heartbeat=0.5
        )


run(AcceptsAnyVersion)
