import msgspec
import numpy as np
import pytest

from perception_worker.calibration.calibration import Calibration, read_calibration, shipped
from perception_worker.calibration.ensemble import stored_ensemble
from protocol.errors import ArtifactDamaged, InvalidConfig
from protocol.skeleton import Joint
from tests.perception_worker.calibration.trees import split, stored


def calibrated(one, points, **given):
    known = {name: np.full(18, 0.5) for name in ("mass", "height", "distance", "spread")} | given
    return one.calibrate(points, camera=(0.0, 0.0, 1.0), **known)


def body():
    return np.tile([4.0, 0.0, 1.0], (18, 1))


class TestCalibrate:
    def test_goes_by_the_trees_and_the_joint_s_own_factor(self):
        trees = stored_ensemble([split("depth_offset", 1.0, 0.1, 2.5)], 1)
        factor = tuple(1.0 + joint / 10 for joint in range(18))
        points = body()
        points[Joint.LEFT_WRIST, 0] += 3.0
        error, radius = calibrated(Calibration(stored(trees, trees, factor=factor)), points)
        expected = np.where(np.arange(18) == Joint.LEFT_WRIST, 2.5, 0.1)
        assert error == pytest.approx(expected)
        assert radius == pytest.approx(expected * factor)

    def test_is_nan_where_a_joint_is_not_located(self):
        points = body()
        points[[3, 8]] = np.nan
        for metres in calibrated(Calibration(stored()), points):
            assert np.flatnonzero(np.isnan(metres)).tolist() == [3, 8]

    def test_is_nan_for_all_of_nobody(self):
        for metres in calibrated(Calibration(stored()), np.full((18, 3), np.nan)):
            assert np.isnan(metres).all()

    def test_is_never_below_nothing(self):
        below = stored_ensemble([{"leaf_value": -0.5}], 1)
        for metres in calibrated(Calibration(stored(below, below)), body()):
            assert not metres.any()


class TestRead:
    def test_says_what_it_can_t_read(self, tmp_path):
        with pytest.raises(InvalidConfig, match="can't read"):
            read_calibration(tmp_path / "nowhere.msgpack")

    @pytest.mark.parametrize("content", [b"", b"no msgpack", msgspec.msgpack.encode({"format": 1})])
    def test_says_what_is_no_calibration(self, tmp_path, content):
        path = tmp_path / "damaged.msgpack"
        path.write_bytes(content)
        with pytest.raises(ArtifactDamaged, match="is no calibration"):
            read_calibration(path)

    @pytest.mark.parametrize("changed", [{"format": 2}, {"features": ("kind",)}])
    def test_refuses_one_of_another_version(self, changed):
        with pytest.raises(ArtifactDamaged, match="another version"):
            Calibration(stored(**changed))


class TestShipped:
    def test_is_one_for_each_setting(self):
        settings = [msgspec.json.encode(one.setting) for one in shipped()]
        assert len(settings) == len(set(settings))

    def test_expects_more_of_a_wrist_that_lies_on_the_wall(self):
        points = body() + np.random.default_rng(0).normal(scale=0.2, size=(18, 3))
        near = calibrated(shipped()[0], points)
        points[Joint.LEFT_WRIST, 0] += 3.0
        far = calibrated(shipped()[0], points)
        assert far.expected_error[Joint.LEFT_WRIST] > 2 * near.expected_error[Joint.LEFT_WRIST]
        assert far.radius[Joint.LEFT_WRIST] > 1.0
