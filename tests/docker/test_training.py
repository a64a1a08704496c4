"""`docker compose up` from nothing to the end of a training."""

import json

from tests.docker.stack import SERVICES


def test_up_trains_to_the_end_with_exit_code_0(control_run):
    assert control_run.exit_code == 0, control_run.output
    assert control_run.exit_codes == dict.fromkeys(SERVICES, 0)


def test_the_results_are_in_the_volume(control_run):
    assert (control_run.run / "weights.safetensors").is_file()
    assert json.loads((control_run.run / "summary.json").read_bytes())
    assert json.loads((control_run.run / "evaluation.json").read_bytes())


def test_nobody_said_a_secret(control_run):
    assert '"secret"' not in control_run.output
