from benchmarks.flakes import tally

PASSED = '<testcase classname="tests.agent.test_main" name="test_ends_well" />'
FAILED = (
    '<testcase classname="tests.agent.test_main" name="test_told"><failure message="assert 0">no</failure></testcase>'
)
BROKEN = '<testcase classname="tests.agent.test_main" name="test_told"><error message="fixture">no</error></testcase>'


def write(path, *cases):
    path.write_text(f"<testsuites><testsuite>{''.join(cases)}</testsuite></testsuites>")
    return path


def test_failures_and_errors_are_counted_by_test(tmp_path):
    results = [write(tmp_path / "0.xml", PASSED, FAILED), write(tmp_path / "1.xml", PASSED, BROKEN)]
    found = tally(results)
    assert found.failures == {"tests.agent.test_main::test_told": 2}
    assert (found.tests, found.repetitions) == (2, 2)
    assert "| `tests.agent.test_main::test_told` | 2 |" in found.table


def test_without_failures_there_is_no_row(tmp_path):
    found = tally([write(tmp_path / "0.xml", PASSED)])
    assert not found.failures
    assert found.table == "1 tests in 1 repetitions, 0 failures"
