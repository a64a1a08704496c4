import numpy as np
import pytest

from orchestrator.pictures.person_in_space import PersonInSpace
from orchestrator.pictures.picture import LEFT_COLOUR, MIDDLE_COLOUR
from orchestrator.pictures.space_picture import (
    ABOVE,
    BACKDROP,
    CAMERA_COLOUR,
    DASH,
    FRONT,
    GROUND_COLOUR,
    LEFT,
    MARKER,
    PAUSE,
    TRUE_COLOUR,
    VIEWS,
    Volume,
    dashes,
    farthest_first,
    grid_picture,
    space_legend,
    space_picture,
    volume_around,
)
from protocol.skeleton import Joint

VOLUME = Volume((0.0, 0.0, 1.1), 100.0, 401, 301)
"""The middle of its pictures is the pixel (200, 150)."""
FAR_CAMERA = np.array([[6.0, 0.0, 1.5], [0.0, 0.0, 1.2]])


def person(
    inferred: bool = False,
    radius: float | None = None,
    camera: np.ndarray = FAR_CAMERA,
    truth: np.ndarray | None = None,
    **joints: tuple[float, float, float],
) -> PersonInSpace:
    points = np.full((18, 3), np.nan)
    for name, point in joints.items():
        points[Joint[name]] = point
    radii = None if radius is None else np.full(18, radius)
    return PersonInSpace(points=points, inferred=np.full(18, inferred), radius=radii, truth=truth, camera=camera)


def has(drawn: np.ndarray, colour: tuple[int, int, int]) -> np.ndarray:
    return (drawn == colour).all(axis=2)


@pytest.mark.parametrize(
    ("view", "point", "pixel"),
    [
        (FRONT, (0.0, 1.0, 1.1), (300, 150)),
        (FRONT, (0.0, 0.0, 2.1), (200, 50)),
        (FRONT, (1.0, 0.0, 1.1), (200, 150)),
        (LEFT, (1.0, 0.0, 1.1), (100, 150)),
        (LEFT, (0.0, 0.0, 2.1), (200, 50)),
        (LEFT, (0.0, 1.0, 1.1), (200, 150)),
        (ABOVE, (0.0, 1.0, 1.1), (300, 150)),
        (ABOVE, (1.0, 0.0, 1.1), (200, 250)),
        (ABOVE, (0.0, 0.0, 2.1), (200, 150)),
    ],
)
def test_a_metre_to_a_side_of_the_person_is_a_metre_from_the_middle_of_the_picture(view, point, pixel):
    assert VOLUME.pixels(np.array([point]), view)[0] == pytest.approx(pixel)
    drawn = space_picture(view, VOLUME, person(LEFT_WRIST=point))
    assert tuple(drawn[pixel[1], pixel[0]]) == LEFT_COLOUR


def test_a_seen_joint_is_a_disc_and_an_inferred_one_a_ring():
    full, hollow = (space_picture(FRONT, VOLUME, person(inferred, NOSE=(0, 0, 1.25))) for inferred in (False, True))
    assert tuple(full[135, 200]) == MIDDLE_COLOUR
    assert tuple(hollow[135, 200]) == BACKDROP
    assert has(hollow, MIDDLE_COLOUR)[135, 200 : 200 + round(MARKER) + 2].any()


def test_a_limb_is_drawn_between_located_joints():
    arm = person(LEFT_SHOULDER=(0, 0, 1.85), LEFT_ELBOW=(0, 0, 1.25), RIGHT_SHOULDER=(0, -0.6, 1.85))
    drawn = space_picture(FRONT, VOLUME, arm)
    assert tuple(drawn[105, 200]) == LEFT_COLOUR
    assert not has(drawn[:, 150:190], LEFT_COLOUR).any()


def test_a_circle_has_its_radius_in_the_pictures_metres():
    where = {"LEFT_WRIST": (0.0, 0.75, 1.35)}
    changed = space_picture(FRONT, VOLUME, person(radius=0.6, **where)) != space_picture(FRONT, VOLUME, person(**where))
    rows, columns = np.nonzero(changed.any(axis=2))
    distances = np.hypot(columns - 275, rows - 125)
    assert len(distances) > 300
    assert np.abs(distances - 60).max() < 2


@pytest.mark.parametrize("radius", [np.nan, np.inf])
def test_a_radius_that_is_no_length_is_not_drawn(radius):
    drawn = [space_picture(FRONT, VOLUME, person(radius=one, NOSE=(0, 0, 1))) for one in (radius, None)]
    assert (drawn[0] == drawn[1]).all()


@pytest.mark.parametrize("view", [FRONT, LEFT])
def test_joints_that_are_not_located_draw_nothing(view):
    assert (space_picture(view, VOLUME, person(radius=0.3)) == grid_picture(view, VOLUME)).all()


def test_the_true_skeleton_is_dashed_and_of_its_own_colour():
    truth = np.full((18, 3), np.nan)
    truth[[Joint.LEFT_HIP, Joint.LEFT_KNEE]] = (0, 0.25, 1.85), (0, 0.25, 0.85)
    drawn = space_picture(FRONT, VOLUME, person(truth=truth))
    along = has(drawn, TRUE_COLOUR)[78:174, 225]
    assert 0.35 < along.mean() < 0.85
    assert np.abs(np.diff(along.astype(int))).sum() >= 2 * 96 // (DASH + PAUSE) - 2


def test_a_dashed_line_begins_and_ends_where_it_should():
    drawn = list(dashes(np.array([0.0, 0.0]), np.array([0.0, 30.0])))
    assert [(begin[1], end[1]) for begin, end in drawn] == [
        pytest.approx(ends) for ends in ((0, 7), (12, 19), (24, 30))
    ]
    assert list(dashes(np.zeros(2), np.zeros(2))) == []


def test_the_ground_is_a_bright_line_from_the_sides_and_none_from_above():
    [grounds] = np.nonzero(has(grid_picture(FRONT, VOLUME), GROUND_COLOUR).all(axis=1))
    assert 260 in grounds
    assert not has(grid_picture(ABOVE, VOLUME), GROUND_COLOUR).any()


def test_lines_are_half_a_metre_apart():
    row = grid_picture(ABOVE, VOLUME)[125, :, 2]
    assert np.flatnonzero(row == row.max()).tolist() == [0, 50, 100, 150, 200, 250, 300, 350, 400]


def test_the_camera_is_an_arrow_to_the_person_in_the_view_from_above_alone():
    at_their_left = np.array([[0.0, 6.0, 1.5], [0.0, 0.0, 1.2]])
    drawn = {view: has(space_picture(view, VOLUME, person(camera=at_their_left)), CAMERA_COLOUR) for view in VIEWS}
    rows, columns = np.nonzero(drawn[ABOVE])
    assert columns.min() > 300
    assert rows.mean() == pytest.approx(150, abs=1)
    # Its head, the taller part, is at the end that is nearer to the person.
    heights = drawn[ABOVE].sum(axis=0)
    assert np.argmax(heights) < columns.mean()
    assert not drawn[FRONT].any()
    assert not drawn[LEFT].any()


def test_the_arrow_of_a_near_camera_begins_there():
    near = np.array([[0.9, 0.0, 1.5], [0.0, 0.0, 1.2]])
    rows, _ = np.nonzero(has(space_picture(ABOVE, VOLUME, person(camera=near)), CAMERA_COLOUR))
    assert rows.max() == pytest.approx(240, abs=2)


def test_what_is_nearer_to_the_viewer_is_drawn_later():
    points = np.full((18, 3), np.nan)
    points[Joint.NOSE], points[Joint.LEFT_ANKLE], points[Joint.NECK] = (0.2, 0, 1.7), (0.0, 0.2, 0.1), (0.0, 0.0, 1.5)
    assert farthest_first(points, ABOVE) == [Joint.LEFT_ANKLE, Joint.NECK, Joint.NOSE]
    assert farthest_first(points, FRONT)[-1] == Joint.NOSE
    assert farthest_first(points, LEFT)[-1] == Joint.LEFT_ANKLE


def test_all_joints_of_a_body_are_shown_from_all_sides():
    points = np.random.default_rng(0).uniform((-0.6, -0.9, 0.0), (0.6, 0.9, 1.8), (18, 3))
    assert volume_around(points, 600, 560).shows(points).all()


def test_a_joint_on_the_wall_behind_does_not_make_the_others_small():
    points = np.random.default_rng(0).uniform((-0.2, -0.4, 0.0), (0.2, 0.4, 1.8), (18, 3))
    points[3] = (-7.0, 0.0, 1.0)
    volume = volume_around(points, 600, 560)
    assert volume.scale > 200
    assert volume.shows(points).sum() == 17


def test_pictures_of_nobody_show_the_place_where_one_would_stand():
    volume = volume_around(np.full((18, 3), np.nan), 600, 560)
    assert volume.centre == (0.0, 0.0, 1.0)
    assert not volume.shows(np.full((18, 3), np.nan)).any()


def test_the_legend_names_what_is_drawn_alone():
    assert len(space_legend(radii=True, truth=True)) == 5
    words = [text for text, _ in space_legend(radii=False, truth=False)]
    assert not any("probability" in text or "true" in text for text in words)
    assert all(swatch.shape == (18, 40, 3) for _, swatch in space_legend(radii=True, truth=True))
