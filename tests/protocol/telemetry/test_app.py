"""The app keeps to its OpenAPI document for every request."""

import pytest
import schemathesis
from hypothesis import HealthCheck, settings
from prometheus_client import CollectorRegistry

from protocol.messages import Role
from protocol.telemetry.app import Control, telemetry_app
from protocol.telemetry.endpoint import Endpoint
from protocol.telemetry.http import served
from protocol.telemetry.info import About, info
from protocol.telemetry.readiness import Wait
from tests.protocol.telemetry.monitors import monitoring

TOKEN = "0123456789abcdef"
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
controlled = telemetry_app(NeverReady(), CollectorRegistry(), Control(TOKEN, lambda: None))
schema = schemathesis.openapi.from_asgi("/openapi.json", controlled)


@schema.parametrize()
@settings(max_examples=10, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
def test_every_answer_is_as_the_document_says(case):
    # Not being ready is an answer, not a server's error; the document has its 503.
    case.call_and_validate(excluded_checks=[schemathesis.checks.not_a_server_error])


class TestControl:
    @pytest.fixture
    def stops(self):
        return []

    @pytest.fixture
    def monitor(self, stops):
        control = Control(TOKEN, lambda: stops.append(True))
        with (
            served(telemetry_app(NeverReady(), CollectorRegistry(), control), Endpoint("127.0.0.1", 0)) as at,
            monitoring(at) as monitor,
        ):
            yield monitor

    def test_who_shows_the_token_ends_the_process(self, monitor, stops):
        assert monitor.post("/control/stop", Authorization=f"Bearer {TOKEN}").status_code == 202
        assert stops == [True]

    @pytest.mark.parametrize(
        "shown", [{}, {"Authorization": "Bearer x"}, {"Authorization": f"Basic {TOKEN}"}, {"Authorization": TOKEN}]
    )
    def test_nobody_else_does(self, monitor, stops, shown):
        answer = monitor.post("/control/stop", **shown)
        assert (answer.status_code, answer.headers["WWW-Authenticate"]) == (401, "Bearer")
        assert stops == []

    def test_looking_at_it_does_nothing(self, monitor, stops):
        assert monitor.get("/control/stop").status_code == 405
        assert stops == []

    def test_without_a_token_it_is_not_there(self):
        with served(app, Endpoint("127.0.0.1", 0)) as at, monitoring(at) as monitor:
            assert monitor.post("/control/stop", Authorization=f"Bearer {TOKEN}").status_code == 404


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
