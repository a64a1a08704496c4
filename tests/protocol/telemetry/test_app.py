"""The app keeps what its OpenAPI document says, whatever is asked of it."""

import schemathesis
from hypothesis import HealthCheck, settings
from prometheus_client import CollectorRegistry

from protocol.messages import Role
from protocol.telemetry.app import telemetry_app
from protocol.telemetry.info import About, info
from protocol.telemetry.readiness import Wait

PATHS = {"/health/live", "/health/ready", "/info", "/metrics"}


class NeverReady:
    """A process that waits for a renderer."""

    def threads(self):
        return ()

    def waits(self):
        return (Wait("render", "none is known"),)

    def info(self):
        about = About(role=Role.PERCEPTION, name="perception-0", serves=("ipc:///x",), capabilities={"network": "thin"})
        return info(about, incarnation="abc", calls={"render": ("ipc:///y",)})


app = telemetry_app(NeverReady(), CollectorRegistry())
schema = schemathesis.openapi.from_asgi("/openapi.json", app)


@schema.parametrize()
@settings(max_examples=10, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
def test_every_answer_is_as_the_document_says(case):
    # Not being ready is an answer, not a server's error; the document has its 503.
    case.call_and_validate(excluded_checks=[schemathesis.checks.not_a_server_error])


def test_the_document_has_every_endpoint_and_the_shape_of_each_answer():
    document = app.openapi()
    assert set(document["paths"]) == PATHS
    schemas = document["components"]["schemas"]
    assert set(schemas) == {"Info", "Liveness", "Readiness", "Role", "Wait"}
    assert set(schemas["Readiness"]["required"]) == {"ready", "waits_for"}
    for path in PATHS - {"/metrics"}:
        for answer in document["paths"][path]["get"]["responses"].values():
            name = answer["content"]["application/json"]["schema"]["$ref"].rpartition("/")[2]
            assert name in schemas
