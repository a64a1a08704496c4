"""`docker compose up` from nothing to the end of a training."""

import json

from tests.docker.stack import SERVICES


def test_up_trains_to_the_end_with_exit_code_0(untouched):
    assert untouched.exit_code == 0, untouched.output
    assert untouched.exit_codes == dict.fromkeys(SERVICES, 0)


def test_the_results_are_in_the_volume(untouched):
    assert (untouched.run / "weights.safetensors").is_file()
    assert json.loads((untouched.run / "summary.json").read_bytes())
    assert json.loads((untouched.run / "evaluation.json").read_bytes())


def test_nobody_said_a_secret(untouched):
    assert '"secret"' not in untouched.output
