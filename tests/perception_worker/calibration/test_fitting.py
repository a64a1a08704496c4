"""On tables whose errors follow a rule that is known."""

import numpy as np
import pytest
from msgspec import msgpack

from perception_worker.calibration.__main__ import main
from perception_worker.calibration.calibration import Calibration
from perception_worker.calibration.choice import open_calibration
from protocol.config import PerceptionConfig, RunConfig, settled
from protocol.errors import InvalidInput

pa = pytest.importorskip("pyarrow")
pytest.importorskip("lightgbm")

import pyarrow.parquet as pq  # noqa: E402

from perception_worker.calibration import fitting  # noqa: E402

PEOPLE, FRAMES = 12, 25


def table(seed=0, first_identity=0):
    """Joints at known places; the error is exponential, 5 cm in the mean or 50 where the depths are spread."""
    random = np.random.default_rng(seed)
    frames = PEOPLE * FRAMES
    spread = np.where(random.random((frames, 18)) < 0.3, 1.0, 0.1)
    points = np.array([4.0, 0.0, 1.0]) + random.normal(scale=0.3, size=(frames, 18, 3))
    columns = {
        "identity": np.repeat(first_identity + np.arange(frames) % PEOPLE, 18),
        "joint": np.tile(np.arange(18), frames),
        "depth_noise": np.repeat("none", frames * 18),
        "error": random.exponential(np.where(spread > 0.5, 0.5, 0.05)).ravel(),
        "spread": spread.ravel(),
        **{name: points[..., axis].ravel() for axis, name in enumerate("xyz")},
        **{f"camera_{name}": np.full(frames * 18, float(name == "z")) for name in "xyz"},
        **{name: np.full(frames * 18, 0.5) for name in ("mass", "height", "distance_quality")},
    }
    columns["error"][::17] = np.nan
    toml = b"[perception]\nlifting = 'nearest'\n"
    return pa.table(columns).replace_schema_metadata({b"vantage.config": toml})


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "table.parquet"
    pq.write_table(table(), path)
    return path


class TestConformalQuantile:
    def test_is_the_score_of_the_rank_that_makes_room_for_one_more(self):
        # Of 9 scores the ceil(10 * 0.9) = 9th; of 19 the 18th; of 99 the 90th.
        assert fitting.conformal_quantile(np.arange(1.0, 10.0)) == 9.0
        assert fitting.conformal_quantile(np.arange(1.0, 20.0)[::-1]) == 18.0
        assert fitting.conformal_quantile(np.arange(1.0, 100.0)) == 90.0

    def test_takes_nine_at_least(self):
        with pytest.raises(InvalidInput, match="too few"):
            fitting.conformal_quantile(np.arange(8.0))


@pytest.mark.slow
class TestFit:
    def test_expects_the_error_that_the_features_tell(self, file):
        stored = fitting.fit(file, version="1.2.3")
        joints = fitting.located_joints(table(seed=1, first_identity=40))
        one = Calibration(stored)
        expected = one._error.predict(joints.features)
        spread = joints.features[:, 4] > 0.5
        assert expected[spread].mean() == pytest.approx(0.47, abs=0.08)
        assert expected[~spread].mean() == pytest.approx(0.05, abs=0.02)

    def test_the_radius_holds_nine_of_ten_on_other_people(self, file):
        one = Calibration(fitting.fit(file, version="1.2.3"))
        joints = fitting.located_joints(table(seed=1, first_identity=40))
        radius = one._reach.predict(joints.features) * one._factor[joints.joint]
        assert (joints.error <= radius).mean() == pytest.approx(0.9, abs=0.03)
        spread = joints.features[:, 4] > 0.5
        assert (joints.error <= radius)[spread].mean() == pytest.approx(0.9, abs=0.05)

    def test_tells_where_it_comes_from(self, file):
        provenance = fitting.fit(file, version="1.2.3").provenance
        assert provenance.version == "1.2.3"
        assert provenance.frames == PEOPLE * FRAMES
        assert provenance.calibrated_on == (3, 7, 11)
        assert provenance.fitted_on == (0, 1, 2, 4, 5, 6, 8, 9, 10)

    def test_is_the_same_each_time(self, file):
        once, again = (msgpack.encode(fitting.fit(file, version="1.2.3")) for _ in range(2))
        assert once == again

    def test_by_the_command_serves_a_worker(self, file, tmp_path, capsys):
        output = tmp_path / "made.msgpack"
        assert main(["fit", str(file), "--output", str(output)]) == 0
        assert '"lifting": "nearest"' in capsys.readouterr().out
        config = settled(PerceptionConfig(calibration=str(output)), RunConfig().profile)
        assert open_calibration(config) is not None


class TestRefused:
    def test_what_is_no_table(self, tmp_path):
        path = tmp_path / "other.parquet"
        path.write_bytes(b"no parquet")
        with pytest.raises(InvalidInput, match="no table"):
            fitting.fit(path, version="")
        pq.write_table(pa.table({"joint": [1]}), path)
        with pytest.raises(InvalidInput, match="orchestrator experiment qoe"):
            fitting.fit(path, version="")

    def test_too_few_people(self, file):
        few = table().filter(pa.compute.less(table()["identity"], 7))
        pq.write_table(few, file)
        with pytest.raises(InvalidInput, match="7 people"):
            fitting.fit(file, version="")

    def test_joints_that_a_learned_lifter_placed(self, file):
        lifted = table().append_column("lifting", pa.array(["learned"] * table().num_rows))
        pq.write_table(lifted, file)
        with pytest.raises(InvalidInput, match='lifting = "nearest"'):
            fitting.fit(file, version="")

    def test_is_said_by_the_command(self, tmp_path):
        assert main(["fit", str(tmp_path / "nowhere"), "--output", str(tmp_path / "out")]) == 2
