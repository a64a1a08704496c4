"""A line a record, a JSON object a line."""

import io
import json
import logging
import warnings

import pytest

from protocol.system import logs


@pytest.fixture
def lines():
    """What the root logger writes once it is configured; all is as before after the test."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    stream = io.StringIO()
    logs.configure("render", stream=stream)
    yield lambda: [json.loads(line) for line in stream.getvalue().splitlines()]
    logging.captureWarnings(capture=False)
    root.handlers[:] = handlers
    root.setLevel(level)


def test_a_record_is_one_line_with_all_that_it_says(lines):
    logging.getLogger("render_worker").info("listens at %s", "ipc:///a", extra={"incarnation": "x", "where": (1, 2)})
    (line,) = lines()
    assert line.pop("time") > 1e9
    assert line == {
        "level": "info",
        "role": "render",
        "logger": "render_worker",
        "message": "listens at ipc:///a",
        "incarnation": "x",
        "where": [1, 2],
    }


def test_an_exception_stays_on_its_line(lines):
    try:
        raise KeyError("lost\nlines")
    except KeyError:
        logging.getLogger("x").exception("failed")
    (line,) = lines()
    assert line["level"] == "error"
    assert "KeyError: 'lost\\nlines'" in line["exception"]


def test_what_json_has_no_form_for_is_shown(lines):
    logging.getLogger("x").info("odd", extra={"value": 1j})
    assert lines()[0]["value"] == "1j"


def test_debug_is_left_out_and_warnings_are_logged(lines):
    logging.getLogger("x").debug("detail")
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.warn("old", UserWarning, stacklevel=1)
    (line,) = lines()
    assert line["logger"] == "py.warnings"
    assert "UserWarning: old" in line["message"]


def test_configuring_again_does_not_double_the_lines(lines):
    stream = io.StringIO()
    logs.configure("agent", stream=stream)
    logging.getLogger("x").info("once")
    assert [json.loads(line)["role"] for line in stream.getvalue().splitlines()] == ["agent"]
    assert lines() == []
