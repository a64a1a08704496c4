"""The HTTP endpoints of a process: `/health/live`, `/health/ready`, `/info`, `/metrics`, perhaps `/control/stop`."""

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, TypeAlias

import msgspec
from fastapi import Depends, FastAPI, Response
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer
from msgspec import Struct
from prometheus_client import CollectorRegistry
from prometheus_client.exposition import CONTENT_TYPE_LATEST, generate_latest

from protocol.telemetry.control import is_same
from protocol.telemetry.info import Info
from protocol.telemetry.liveness import Liveness, liveness
from protocol.telemetry.readiness import Readiness, readiness
from protocol.telemetry.subject import Subject

_BODIES = (Info, Liveness, Readiness)
_Shown: TypeAlias = Annotated[HTTPAuthorizationCredentials | None, Depends(HTTPBearer(auto_error=False))]
_TEXT = {"content": {"text/plain": {"schema": {"type": "string"}}}}


class Control(NamedTuple):
    """What a caller needs to end the process, and the function that ends it.

    Attributes:
        token: the bearer token that a caller has to send.
        stop: asks the process to end.
    """

    token: str
    stop: Callable[[], None]


def telemetry_app(subject: Subject, registry: CollectorRegistry, control: Control | None = None) -> FastAPI:
    """The endpoints of a process, with its metrics from `registry`; without `control`, nothing can be changed."""
    # Without FastAPI's documentation pages, which load scripts from other sites.
    app = FastAPI(title="Vantage: how a process is", version="1", docs_url=None, redoc_url=None)

    # All handlers are coroutines: none waits for long, and FastAPI would run plain functions in threads.
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
    if control is not None:
        _add_control(app, control)
    _describe_bodies(app)
    return app


def _add_control(app: FastAPI, control: Control) -> None:
    async def stop(credentials: _Shown = None) -> Response:
        """End the process in order, as SIGTERM does: what is in hand is finished, what was learned is written."""
        if credentials is None or not is_same(credentials.credentials, control.token):
            return Response(status_code=401, headers={"WWW-Authenticate": "Bearer"})
        control.stop()
        return Response(status_code=202)

    answers: dict[int | str, dict[str, Any]] = {
        202: {"description": "it ends"},
        401: {"description": "the token was not shown: `Authorization: Bearer TOKEN`"},
    }
    app.post("/control/stop", status_code=202, responses=answers, response_class=Response)(stop)


def _answer(body: Struct, *, ok: bool) -> Response:
    # A monitor needs the current state, so no cache may keep the answer.
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
