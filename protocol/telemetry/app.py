"""The HTTP endpoints of a process: `/health/live`, `/health/ready`, `/info` and `/metrics`."""

from typing import Any

import msgspec
from fastapi import FastAPI, Response
from msgspec import Struct
from prometheus_client import CollectorRegistry
from prometheus_client.exposition import CONTENT_TYPE_LATEST, generate_latest

from protocol.telemetry.info import Info
from protocol.telemetry.liveness import Liveness, liveness
from protocol.telemetry.readiness import Readiness, readiness
from protocol.telemetry.subject import Subject

_BODIES = (Info, Liveness, Readiness)
_TEXT = {"content": {"text/plain": {"schema": {"type": "string"}}}}


def telemetry_app(subject: Subject, registry: CollectorRegistry) -> FastAPI:
    """The endpoints of a process, with its metrics from `registry`."""
    # Without the pages that show the document: they load scripts from elsewhere.
    app = FastAPI(title="Vantage: how a process is", version="1", docs_url=None, redoc_url=None)

    # Coroutines, all of them: nothing here waits for long, and others would be given threads.
    async def live() -> Response:
        """Whether the threads that carry the process's messages answer."""
        state = await liveness(subject.threads())
        return _answer(state, ok=state.live)

    async def ready() -> Response:
        """Whether the process can do its work, or what it waits for."""
        state = readiness(subject.waits())
        return _answer(state, ok=state.ready)

    async def about() -> Response:
        """What the process is."""
        return _answer(subject.info(), ok=True)

    async def metrics() -> Response:
        """Metrics in Prometheus' text format."""
        return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)

    app.get("/health/live", responses=_either("it does", "it does not", Liveness))(live)
    app.get("/health/ready", responses=_either("it can", "it can not yet", Readiness))(ready)
    app.get("/info", responses={200: {"description": "it is so", **_json(Info)}})(about)
    app.get("/metrics", responses={200: {"description": "as they are now", **_TEXT}}, response_class=Response)(metrics)
    _describe_bodies(app)
    return app


def _answer(body: Struct, *, ok: bool) -> Response:
    # Asked again each time: what was so a moment ago is of no use.
    headers = {"Cache-Control": "no-store"}
    return Response(msgspec.json.encode(body), 200 if ok else 503, headers, "application/json")


def _either(well: str, badly: str, body: type[Struct]) -> dict[int | str, dict[str, Any]]:
    return {200: {"description": well, **_json(body)}, 503: {"description": badly, **_json(body)}}


def _json(body: type[Struct]) -> dict[str, Any]:
    return {"content": {"application/json": {"schema": {"$ref": _reference(body.__name__)}}}}


def _reference(name: str) -> str:
    return f"#/components/schemas/{name}"


def _describe_bodies(app: FastAPI) -> None:
    """Add the bodies' schemas to the OpenAPI document; FastAPI does not know msgspec's types."""
    _, schemas = msgspec.json.schema_components(_BODIES, ref_template=_reference("{name}"))
    # FastAPI makes the document once and keeps it, so what is added to it stays.
    app.openapi().setdefault("components", {}).setdefault("schemas", {}).update(schemas)
