import json
import logging
import sys

from rich.console import Console

from orchestrator.hosting.host_display import open_host_display
from orchestrator.monitoring.live_display import Snapshot

SNAPSHOT = Snapshot(activity="host at tcp://host:5600 is open", elapsed=1.0)


def say(console: Console) -> None:
    with open_host_display(console) as display:
        logging.getLogger("orchestrator.supervision.registry").info("render-0 registered")
        display.show(SNAPSHOT)
    logging.getLogger("orchestrator.supervision.registry").info("nobody hears this")


def test_where_nobody_looks_the_log_is_one_of_json_lines(capsys):
    say(Console(file=sys.stderr))
    (line,) = capsys.readouterr().err.splitlines()
    assert (json.loads(line)["message"], json.loads(line)["role"]) == ("render-0 registered", "orchestrator")


def test_on_a_terminal_there_is_a_live_view_with_the_log_above_it(capsys):
    say(Console(file=sys.stderr, force_terminal=True))
    said = "".join(capsys.readouterr())
    assert "render-0 registered" in said
    assert "host at tcp://host:5600 is open" in said
    assert "nobody hears this" not in said
