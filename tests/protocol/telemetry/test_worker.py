"""A worker behind a real socket is asked over real HTTP how it is, and what it says is so."""

import os
import signal
import subprocess
import sys
import threading

import pytest
from msgspec.structs import replace

from protocol import Limits, Pool, serve
from protocol.errors import AddressUnavailable, Unavailable
from protocol.messages import Drain, Role, SampleScene
from protocol.observer import NO_OBSERVER
from protocol.telemetry.info import About
from protocol.telemetry.worker import worker_telemetry
from tests.protocol.processes.bare_client import bare_client
from tests.protocol.processes.calls import PATIENT, ask, client_of
from tests.protocol.processes.serving import SCENES, serving
from tests.protocol.processes.waiting import wait_until
from tests.protocol.telemetry.monitors import free_endpoint, monitoring
from tests.protocol.telemetry.observing import Held, observed
from tests.protocol.workers.scenes import scene_for


class TestLive:
    def test_it_lives_while_a_handler_computes(self, address):
        held = Held()
        with observed(address, held.handlers) as monitor, client_of(address) as client:
            pending = client.submit(ask(1))
            assert held.begun.wait(20)
            response = monitor.get("/health/live")
            assert (response.status_code, response.json()) == (200, {"live": True})
            held.may_end.set()
            pending.result()

    @pytest.mark.slow
    def test_it_does_not_once_its_io_thread_hangs(self, address):
        at, hangs, may_go_on = free_endpoint(), threading.Event(), threading.Event()
        about = About(role=Role.RENDER, name="render-0")

        class Sticky:
            """An observer that holds up who tells it of a refusal: the listener's thread."""

            def attend(self, worker):
                observer.attend(worker)

            def finished(self, request):
                if request.outcome == "refused":
                    hangs.set()
                    may_go_on.wait(20)

        with (
            worker_telemetry(at, about) as observer,
            serving(
                address,
                {SampleScene: lambda request: may_go_on.wait(20) and scene_for(1)},
                observer=Sticky(),
                limits=Limits(queue=1),
            ),
            bare_client(address) as client,
            monitoring(at) as monitor,
        ):
            assert monitor.get("/health/live").status_code == 200
            client.ask(ask(1), 1)
            client.ask(ask(2), 2)
            assert hangs.wait(20)
            response = monitor.get("/health/live")
            assert (response.status_code, response.json()) == (503, {"live": False})
            may_go_on.set()
            wait_until(lambda: monitor.get("/health/live").status_code == 200)


class TestReady:
    def test_it_is_ready_once_it_has_started(self, address):
        release = threading.Event()

        def load():
            release.wait(20)
            return SCENES

        with observed(address, load) as monitor:
            response = monitor.get("/health/ready")
            assert response.status_code == 503
            assert response.json()["ready"] is False
            assert monitor.waits_on() == {"start"}
            assert monitor.metric("vantage_ready") == 0
            assert monitor.get("/health/live").status_code == 200
            release.set()
            wait_until(monitor.is_ready)
            assert monitor.json("/health/ready") == {"ready": True, "waits_for": []}
            assert monitor.metric("vantage_ready") == 1

    def test_it_is_not_while_it_drains(self, address):
        held, at = Held(), free_endpoint()
        with (
            worker_telemetry(at, About(role=Role.RENDER, name="r")) as observer,
            monitoring(at) as monitor,
            client_of(address) as client,
        ):
            options = {"role": Role.RENDER, "bind": address, "observer": observer}
            worker = threading.Thread(target=serve, args=(lambda: held.handlers,), kwargs=options, daemon=True)
            worker.start()
            client.submit(ask(1))
            assert held.begun.wait(20)
            assert monitor.is_ready()
            client.submit(Drain())
            wait_until(lambda: not monitor.is_ready())
            assert monitor.waits_on() == {"end"}
            held.may_end.set()
            worker.join(20)
            assert not worker.is_alive()

    @pytest.mark.slow
    def test_a_parent_is_ready_only_while_a_child_is_at_work(self, address, start):
        children = f"{address}-0", f"{address}-1"
        with (
            Pool(children, role=Role.PERCEPTION, serves=Role.RENDER, timeouts=PATIENT) as pool,
            observed(address, calls={Role.RENDER: pool}, role=Role.PERCEPTION) as monitor,
        ):
            assert monitor.waits_on() >= {"render"}
            assert all(child in monitor.get("/health/ready").text for child in children)
            first = start("serves_scenes", children[0])
            wait_until(monitor.is_ready)
            second = start("serves_scenes", children[1])
            wait_until(lambda: monitor.metric("vantage_workers", serves="render", at_work="true") == 2)
            first.kill()
            wait_until(lambda: monitor.metric("vantage_workers", serves="render", at_work="false") == 1)
            assert monitor.is_ready()
            second.kill()
            wait_until(lambda: not monitor.is_ready())
            assert monitor.waits_on() == {"render"}
            assert monitor.get("/health/live").status_code == 200
            start("serves_scenes", children[1])
            wait_until(monitor.is_ready)

    @pytest.mark.slow
    def test_a_child_that_hangs_is_missed_though_nothing_is_asked_of_it(self, address, start):
        child = f"{address}-0"
        timeouts = replace(PATIENT, liveness=0.3)
        with (
            Pool([child], role=Role.PERCEPTION, serves=Role.RENDER, timeouts=timeouts) as pool,
            observed(address, calls={Role.RENDER: pool}, role=Role.PERCEPTION) as monitor,
        ):
            process = start("serves_scenes", child)
            wait_until(monitor.is_ready)
            process.send_signal(signal.SIGSTOP)
            # Without pings it would be missed as well, but later: its connection breaks.
            wait_until(lambda: "it answers no pings" in monitor.get("/health/ready").text)
            assert not monitor.is_ready()
            process.send_signal(signal.SIGCONT)
            wait_until(monitor.is_ready)


class TestInfo:
    def test_it_says_what_the_process_is(self, address):
        with observed(address) as monitor, client_of(address) as client:
            told = monitor.json("/info")
            assert told["incarnation"] == client.ping().incarnation
            del told["incarnation"], told["version"]
            assert told == {
                "role": "render",
                "name": "render-0",
                "protocol": 1,
                "serves": [address],
                "calls": {},
                "pid": os.getpid(),
                "capabilities": {"renderer": "opengl"},
            }

    def test_it_names_who_is_called(self, address):
        with (
            Pool([f"{address}-0"], role=Role.PERCEPTION, serves=Role.RENDER, timeouts=PATIENT) as pool,
            observed(address, calls={Role.RENDER: pool}) as monitor,
        ):
            pool.add(f"{address}-1")
            assert monitor.json("/info")["calls"] == {"render": [f"{address}-0", f"{address}-1"]}

    def test_nothing_of_the_environment_or_the_command_line_is_told(self, address, monkeypatch):
        monkeypatch.setenv("VANTAGE_SECRET_KEY", "hush-hush")
        monkeypatch.setattr(sys, "argv", [*sys.argv, "--key", "not-for-you"])
        with observed(address) as monitor:
            for path in ("/info", "/metrics", "/health/ready", "/openapi.json"):
                assert not any(secret in monitor.get(path).text for secret in ("hush-hush", "not-for-you"))


class TestWithout:
    def test_nobody_watches_and_nothing_is_served(self):
        with worker_telemetry(None, About(role=Role.RENDER, name="r")) as observer:
            assert observer is NO_OBSERVER

    @pytest.mark.slow
    def test_no_library_for_it_is_loaded(self):
        program = (
            "import sys\n"
            "import render_worker.worker, perception_worker.worker, agent.commands, agent.__main__\n"
            "from protocol.messages import Role\n"
            "from protocol.telemetry.info import About\n"
            "from protocol.telemetry.worker import worker_telemetry\n"
            "with worker_telemetry(None, About(role=Role.RENDER, name='r')):\n"
            "    print({'fastapi', 'starlette', 'uvicorn', 'prometheus_client', 'pydantic'} & set(sys.modules))\n"
        )
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == "set()"

    def test_a_library_that_is_missing_is_named(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "uvicorn", None)
        monkeypatch.delitem(sys.modules, "protocol.telemetry.http", raising=False)
        about = About(role=Role.RENDER, name="r")
        with pytest.raises(Unavailable, match="needs uvicorn"), worker_telemetry(free_endpoint(), about):
            pass

    @pytest.mark.slow
    def test_a_port_in_use_ends_it_before_anything_is_loaded(self, address):
        at = free_endpoint()
        about = About(role=Role.RENDER, name="r")
        with (
            worker_telemetry(at, about),
            pytest.raises(AddressUnavailable, match="in use"),
            worker_telemetry(at, about),
        ):
            pass
