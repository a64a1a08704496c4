import numpy as np
import pytest

from protocol.errors import InvalidInput
from protocol.grid.table import CELLS, CENTRE, cell_of
from protocol.grid.threshold import best_uncertainties, ceiling, threshold_by_rule, weighted_uncertainties
from protocol.skeleton import JOINT_COUNT, Joint
from tests.protocol.grid.tables import table


def of_best(*best: float) -> np.ndarray:
    """Environments that are uncertain everywhere, and less so in one cell."""
    weighted = np.full((len(best), CELLS), 10.0)
    weighted[:, cell_of(3, 0)] = best
    return weighted


def test_a_cell_is_as_uncertain_as_the_weights_of_its_joints_say():
    # A nose of quality (0.2 + 0.4 + 0.9) / 3 = 0.5 and a left wrist that was not found: 2 · 0.5 + 0.5 · 1.
    mass, height, distance = (np.ones((1, CELLS, JOINT_COUNT), np.float32) for _ in range(3))
    for values, nose in ((mass, 0.2), (height, 0.4), (distance, 0.9)):
        values[0, :, Joint.NOSE], values[0, :, Joint.LEFT_WRIST] = nose, 0.0
    weighted = weighted_uncertainties(table({"mass": mass, "height": height, "distance": distance}))
    assert weighted.shape == (1, CELLS)
    assert weighted[0, cell_of(3, 0)] == pytest.approx(1.5, abs=1e-6)


def test_the_centre_has_no_view_whatever_is_stored_for_it():
    weighted = weighted_uncertainties(table({"mass": 1.0, "height": 1.0, "distance": 1.0}))
    assert weighted[0, CENTRE] == 10.0
    assert weighted[0].sum() == 10.0


def test_in_metres_a_tenth_of_a_metre_is_as_uncertain_as_no_estimate():
    # 2 · 0.05 / 0.1 for the nose, 2 for each eye, that is off by a metre or not found, and nothing for the others.
    errors = np.zeros((1, CELLS, JOINT_COUNT), np.float32)
    errors[0, :, [Joint.NOSE, Joint.LEFT_EYE, Joint.RIGHT_EYE]] = np.array([[0.05], [1.0], [np.nan]])
    weighted = weighted_uncertainties(table({"expected_error": errors}, "metres"))
    assert weighted[0, cell_of(-2, 5)] == pytest.approx(1.0 + 2.0 + 2.0, abs=1e-6)


def test_the_best_cell_is_never_the_centre():
    weighted = of_best(1.0, 2.0)
    weighted[:, CENTRE] = 0.0
    assert best_uncertainties(weighted).tolist() == [1.0, 2.0]


def test_the_ceiling_is_the_share_with_a_cell_below_the_threshold_and_not_at_it():
    weighted = of_best(0.9, 1.1, 1.0, 5.0)
    assert ceiling(weighted, 1.1) == 0.5
    assert ceiling(weighted, 1.15) == 0.75


def test_the_threshold_is_the_lowest_step_at_which_nineteen_of_twenty_succeed():
    assert threshold_by_rule(of_best(*[1.02] * 19, 5.0)) == 1.05
    assert threshold_by_rule(of_best(*[1.02] * 18, 1.31, 5.0)) == 1.35


def test_a_cell_at_a_step_succeeds_at_the_next():
    assert threshold_by_rule(of_best(1.05)) == 1.1


def test_environments_that_show_nobody_have_no_threshold():
    with pytest.raises(InvalidInput, match="90% of the train environments"):
        threshold_by_rule(of_best(*[1.0] * 9, 10.0))
