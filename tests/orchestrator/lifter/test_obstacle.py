import numpy as np

from orchestrator.lifter.obstacle import hide_behind_board
from protocol.camera import Camera, CameraPose, Intrinsics, project
from protocol.frame import Frame
from tests.perception_worker.lifter.bodies import joints

CAMERA = Camera(CameraPose((4.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(320, 240, 70.0))
FRAME = Frame(rgb=np.zeros((240, 320, 3), np.uint8), depth=np.full((240, 320), 5.0, np.float32), camera=CAMERA)


def test_a_board_is_before_the_person_and_over_some_of_them():
    far = project(joints(), CAMERA)[:, 2].min()
    for seed in range(30):
        hidden = hide_behind_board(FRAME, joints(), np.random.default_rng(seed))
        covered = hidden.depth != FRAME.depth
        assert covered.any()
        assert not covered.all()
        assert hidden.depth[covered].max() < far
        rows, columns = np.nonzero(covered)
        pixels = project(joints(), CAMERA)[:, :2]
        assert columns.max() >= pixels[:, 0].min()
        assert rows.min() <= pixels[:, 1].max()


def test_the_frame_itself_stays_as_it_was():
    before = FRAME.depth.copy()
    hide_behind_board(FRAME, joints(), np.random.default_rng(0))
    np.testing.assert_array_equal(FRAME.depth, before)
