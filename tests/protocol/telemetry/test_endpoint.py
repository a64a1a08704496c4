import argparse

import pytest

from protocol.errors import InvalidInput
from protocol.telemetry.endpoint import Endpoint, add_http_options, parse_endpoint


@pytest.mark.parametrize("text", ["8000", ":8000", "127.0.0.1:8000"])
def test_without_a_host_it_is_this_machine_alone(text):
    assert parse_endpoint(text) == Endpoint("127.0.0.1", 8000)


@pytest.mark.parametrize(
    ("text", "host"), [("0.0.0.0:80", "0.0.0.0"), ("gpu-box:80", "gpu-box"), ("[::1]:80", "::1"), ("[::]:80", "::")]
)
def test_another_host_is_written_out(text, host):
    assert parse_endpoint(text) == Endpoint(host, 80)
    assert str(parse_endpoint(text)) == text


@pytest.mark.parametrize("text", ["", ":", "box", "box:", "box:http", "65536", "-1", "::1:80", "1.5", "٨٠"])
def test_what_names_no_port_is_refused(text):
    with pytest.raises(InvalidInput, match="HOST:PORT"):
        parse_endpoint(text)


def test_it_knows_whether_only_this_machine_gets_there():
    loopback = {"127.0.0.1", "127.8.0.1", "localhost", "::1"}
    hosts = [*loopback, "0.0.0.0", "::", "gpu-box", "10.0.0.1"]
    assert {host for host in hosts if Endpoint(host, 1).is_loopback} == loopback


class TestOption:
    @pytest.fixture
    def parser(self):
        parser = argparse.ArgumentParser()
        add_http_options(parser)
        return parser

    def test_by_default_there_is_none(self, parser):
        assert parser.parse_args([]).http is None

    def test_it_gives_the_endpoint(self, parser):
        assert parser.parse_args(["--http", ":0"]).http == Endpoint("127.0.0.1", 0)

    def test_a_mistake_is_named(self, parser, capsys):
        with pytest.raises(SystemExit):
            parser.parse_args(["--http", "nowhere"])
        assert "'nowhere' is not an HTTP endpoint" in capsys.readouterr().err
