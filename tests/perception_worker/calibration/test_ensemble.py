import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.calibration.ensemble import Ensemble, stored_ensemble
from protocol.errors import ArtifactDamaged


def node(feature, threshold, left, right):
    return {"split_feature": feature, "threshold": threshold, "left_child": left, "right_child": right}


def leaf(value):
    return {"leaf_value": value}


def samples(*rows):
    return np.array(rows, np.float32)


class TestOneTree:
    TREE = node(0, 1.0, leaf(10.0), node(1, 2.0, leaf(20.0), leaf(30.0)))

    def test_goes_right_above_the_threshold_and_left_at_it(self):
        tree = Ensemble(stored_ensemble([self.TREE], 2), feature_count=2)
        given = samples((1.0, 9.0), (1.5, 2.0), (1.5, 2.5))
        assert tree.predict(given).tolist() == [10.0, 20.0, 30.0]

    def test_that_is_a_leaf_says_the_same_of_all(self):
        tree = Ensemble(stored_ensemble([leaf(4.0)], 3), feature_count=1)
        assert tree.predict(samples((-1e9,), (1e9,))).tolist() == [4.0, 4.0]


class TestManyTrees:
    def test_add_up(self):
        trees = [node(0, 0.0, leaf(1.0), leaf(2.0)), leaf(10.0), node(1, 5.0, leaf(100.0), leaf(200.0))]
        ensemble = Ensemble(stored_ensemble(trees, 1), feature_count=2)
        assert ensemble.predict(samples((-1.0, 6.0), (1.0, 0.0))).tolist() == [211.0, 112.0]

    @pytest.mark.slow
    def test_say_what_lightgbm_says_of_the_same_trees(self):
        lightgbm = pytest.importorskip("lightgbm")
        random = np.random.default_rng(0)
        known = random.normal(size=(2000, 5)).astype(np.float32)
        target = known[:, 0] * (known[:, 1] > 0.3) + np.abs(known[:, 2])
        settings = {"max_depth": 4, "num_leaves": 16, "verbosity": -1, "num_threads": 1, "use_missing": False}
        booster = lightgbm.train(settings, lightgbm.Dataset(known, target), 30)
        trees = [tree["tree_structure"] for tree in booster.dump_model()["tree_info"]]
        new = random.normal(size=(300, 5)).astype(np.float32)
        ours = Ensemble(stored_ensemble(trees, 4), feature_count=5).predict(new)
        assert ours == pytest.approx(booster.predict(new), abs=1e-5)


class TestDamaged:
    STORED = stored_ensemble([node(0, 1.0, leaf(1.0), leaf(2.0))], 1)

    @pytest.mark.parametrize(
        "damaged",
        [
            replace(STORED, features=STORED.features[:-1]),
            replace(STORED, leaves=STORED.leaves[:-4]),
            replace(STORED, thresholds=STORED.thresholds + b"\0\0\0\0"),
            replace(STORED, features=b"", thresholds=b"", leaves=b""),
            replace(STORED, features=b"\x09"),
            replace(STORED, leaves=STORED.leaves[:-1]),
            replace(STORED, leaves=STORED.leaves[:-4] + np.float32(np.nan).tobytes()),
            replace(STORED, thresholds=np.float32(np.nan).tobytes()),
        ],
    )
    def test_is_refused(self, damaged):
        with pytest.raises(ArtifactDamaged, match="trees"):
            Ensemble(damaged, feature_count=2)
