import numpy as np
import pyarrow as pa
import pytest

from orchestrator.experiments.figures.flight_figures import comparisons, flight_figures, flown_samples
from orchestrator.experiments.flights import SCHEMA_OF_FLIGHTS
from orchestrator.experiments.pages.flight_page import flight_sections
from orchestrator.experiments.pages.flight_plot import flights_plot


@pytest.fixture
def flown(made_up_table) -> pa.Table:
    return as_flights(made_up_table(40))


@pytest.fixture
def learned(made_up_table) -> pa.Table:
    return as_flights(made_up_table(40, lifting="learned"))


def as_flights(table: pa.Table) -> pa.Table:
    """The made-up frames as eight flights; the filter is off by its own deviation, and has never seen a nose."""
    rows = table.num_rows
    frame = table["frame"].to_numpy()
    truth = {axis: table[f"true_{axis}"].to_numpy() for axis in "xyz"}
    deviation = np.random.default_rng(2).uniform(0.1, 0.9, size=rows)
    added = {
        "flight": frame % 8,
        "path": np.where(frame % 2 == 0, "circle", "front"),
        "step": frame // 8,
        "filter_x": truth["x"] + deviation,
        "filter_y": truth["y"],
        "filter_z": truth["z"],
        "filter_error": deviation,
        "deviation": deviation,
        **{f"posterior_{axis}": deviation**2 / 3 for axis in "xyz"},
        **{f"variance_{axis}": np.full(rows, 0.01) for axis in "xyz"},
        "seen": table["joint"].to_numpy() != 0,
    }
    columns = {name: table[name] for name in table.column_names} | {
        name: pa.array(values) for name, values in added.items()
    }
    return pa.table({name: columns[name].cast(SCHEMA_OF_FLIGHTS.field(name).type) for name in SCHEMA_OF_FLIGHTS.names})


def test_frames_are_told_apart_by_path(flown):
    samples = flown_samples(flown)
    assert {place: len(sample) for place, sample in samples.items()} == {
        (noise, path): count
        for noise in ("none", "d435i")
        for path, count in (("all", 40), ("circle", 20), ("front", 20))
    }


def test_the_posterior_is_held_against_the_error_of_the_filters_mean(flown):
    sample = flown_samples(flown)["none", "all"]
    found = comparisons(sample)
    everything = found["posterior deviation → filter's error, all joints seen"]
    assert everything.located.sum() == 40 * 17
    assert everything.error[:, 1:] == pytest.approx(sample["deviation"][:, 1:], abs=1e-6)
    ours = found["posterior deviation → filter's error"]
    assert (ours.located == (sample["located"] == 1)).all()
    frame = found["1 − quality → frame's error"]
    assert frame.error[frame.located] == pytest.approx(sample["error"][frame.located], abs=1e-6)


def test_a_posterior_that_is_the_error_correlates_with_it_fully(flown):
    figures = flight_figures(flown)
    own = next(
        one
        for one in figures.scores
        if (one.noise, one.band, one.uncertainty)
        == ("none", "circle", "posterior deviation → filter's error, all joints seen")
    )
    assert own.joint_raw.value == pytest.approx(1.0)
    assert own.located_raw.value == pytest.approx(1.0)
    assert (figures.flights, figures.steps, figures.lifting) == (8, 5, "nearest")


def test_mean_errors_by_hand(flown):
    sample = flown_samples(flown)["none", "front"]
    own = next(one for one in flight_figures(flown).errors if (one.noise, one.path) == ("none", "front"))
    located, seen = sample["located"] == 1, sample["seen"] == 1
    assert own.frame.value == pytest.approx(np.minimum(sample["error"][located], 1).mean())
    assert own.filtered.value == pytest.approx(sample["filter_error"][located].mean())
    assert own.seen.value == pytest.approx(sample["filter_error"][seen].mean())


def test_joints_that_a_learned_lifter_inferred_are_not_those_of_the_frame(learned):
    sample = flown_samples(learned)["none", "all"]
    detected = sample["detected"] == 1
    assert (sample["located"] == 1).all()
    found = comparisons(sample)
    for error in ("frame's error", "filter's error"):
        assert (found[f"expected error → {error}"].located == detected).all()
    figures = flight_figures(learned)
    own = next(one for one in figures.errors if (one.noise, one.path) == ("none", "all"))
    assert own.frame.value == pytest.approx(sample["error"][detected].mean())
    assert own.filtered.value == pytest.approx(sample["filter_error"][detected].mean())
    assert {one.wrong for one in figures.scores} == {0.10}
    assert "joints that it inferred" in "\n".join(flight_sections(figures))


@pytest.mark.slow
def test_the_page_and_the_plot_have_both_paths_and_noises(flown):
    text = "\n".join(flight_sections(flight_figures(flown)))
    assert "8 flights of 5 pictures" in text
    assert "| none | circle |" in text
    assert "nan" not in text
    titles = {place.get_title() for place in flights_plot(flown).axes}
    assert titles == {
        f"{path}, {depth}, n = 4 flights"
        for path in ("circle", "front")
        for depth in ("exact depth", "depth noise (d435i)")
    }
