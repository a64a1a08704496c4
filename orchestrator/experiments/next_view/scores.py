"""How good the choices of the next view are: top-1 errors, and the share of the possible improvement."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from msgspec import Struct

from orchestrator.experiments.figures.bootstrap import (
    Figure,
    IntArray,
    figure,
    mean,
    people_of,
    quantile,
    samples_of_people,
)
from orchestrator.experiments.list_columns import numbers_in
from orchestrator.experiments.next_view.views import CELLS, CENTRE
from protocol.arrays import BoolArray, Float64Array
from protocol.errors import DamagedRecord
from protocol.scene import Split
from protocol.skeleton import upper_body_weights

CHANCE = 1 - 1 / (len(CELLS) - 1)
"""The top-1 error of a random choice among eight cameras."""

NEAR = 0.1
"""Weighted uncertainty, 0 to 10, by which a choice may be above the best to count as right as well."""


class WayScores(Struct, frozen=True, kw_only=True):
    """One way of choosing: means over its seeds, with the 95% interval by bootstrap over people.

    Attributes:
        seeds: number of trainings.
        train_error: share of the train scenes in which another camera than the chosen one is best.
        error, lowest_error, highest_error: of the test scenes; and of the best and the worst seed.
        near_error: where a choice counts as right if it is at most `NEAR` above the best.
        share: the mean improvement over the centre that the choice gets, divided by that of the best camera.
        uncertainty: mean of the chosen cameras.
    """

    group: str
    method: str
    seeds: int
    train_error: float
    error: Figure
    lowest_error: float
    highest_error: float
    near_error: Figure
    share: Figure
    uncertainty: Figure


class NextViewScores(Struct, frozen=True, kw_only=True):
    """All scores of an experiment.

    Attributes:
        train, test: number of scenes.
        undecided: scenes that are left out, since all eight cameras are alike: none finds the person.
        people: in the test scenes.
        spacing: of the cameras, metres.
        chance: top-1 error of a random choice.
        best_by_camera: share of the test scenes in which each camera around the centre is best, in order.
        centre, best: mean uncertainty of the centre, and of the best camera around it.
        lead: by how much the best camera is below the second best, the median.
        ways: of choosing.
    """

    train: int
    test: int
    undecided: int
    people: int
    spacing: float
    chance: float
    best_by_camera: tuple[float, ...]
    centre: Figure
    best: Figure
    lead: Figure
    ways: tuple[WayScores, ...]


class Scenes(Struct, frozen=True, eq=False, kw_only=True):
    """The scenes of one split that have a best camera.

    Attributes:
        decided: (all scenes of the split,) which those are.
        around: (n, 8) uncertainty of the cameras around the centre.
        centre: (n,) of the centre.
        person: (n,) whose, by numbers from 0 on.
    """

    decided: BoolArray
    around: Float64Array
    centre: Float64Array
    person: IntArray

    @property
    def best(self) -> Float64Array:
        """(n,) the lowest uncertainty around the centre."""
        return self.around.min(axis=1)

    @property
    def lead(self) -> Float64Array:
        """(n,) by how much the second lowest is above that."""
        lowest = np.partition(self.around, 1, axis=1)
        return lowest[:, 1] - lowest[:, 0]

    def chosen(self, expected: Float64Array) -> Float64Array:
        """(n,) the uncertainty of the cameras with the lowest expectation.

        Args:
            expected: (all scenes of the split, 8).
        """
        choice = expected[self.decided].argmin(axis=1)
        return np.take_along_axis(self.around, choice[:, None], axis=1)[:, 0]


def scores_of(table: Path, choices: Path, spacing: float) -> NextViewScores:
    """The scores of all choices.

    Args:
        table: of the views.
        choices: as `perception_worker.next_view` writes them.
        spacing: of the cameras, metres.

    Raises:
        DamagedRecord: the choices are of other scenes.
    """
    views, chosen = pq.read_table(table), pq.read_table(choices)
    train, test = scenes_of(views, "train"), scenes_of(views, "test")
    samples = samples_of_people(int(test.person.max()) + 1)
    names = dict.fromkeys(zip(chosen["group"].to_pylist(), chosen["method"].to_pylist(), strict=True))
    return NextViewScores(
        train=len(train.centre),
        test=len(test.centre),
        undecided=int((~train.decided).sum() + (~test.decided).sum()),
        people=samples.shape[1],
        spacing=spacing,
        chance=CHANCE,
        best_by_camera=tuple((np.bincount(test.around.argmin(axis=1), minlength=8) / len(test.centre)).tolist()),
        centre=figure(mean(test.centre, test.person, samples)),
        best=figure(mean(test.best, test.person, samples)),
        lead=figure(quantile(test.lead, 0.5, test.person, samples)),
        ways=tuple(
            _way_scores(group, method, _expected(chosen, group, method, (train, test)), (train, test), samples)
            for group, method in names
        ),
    )


def scenes_of(views: pa.Table, split: Split) -> Scenes:
    """The scenes of a split."""
    own = _of(views, split=split)
    quality = numbers_in(own, "quality").astype(np.float64).reshape(-1, len(CELLS), len(upper_body_weights()))
    uncertainty = (1.0 - quality) @ upper_body_weights()
    around = np.delete(uncertainty, CENTRE, axis=1)
    decided = around.min(axis=1) < around.max(axis=1)
    identity = own["identity"].to_numpy()[CENTRE :: len(CELLS)]
    return Scenes(
        decided=decided,
        around=around[decided],
        centre=uncertainty[decided, CENTRE],
        person=people_of(identity[decided]),
    )


def _expected(
    chosen: pa.Table, group: str, method: str, splits: tuple[Scenes, Scenes]
) -> tuple[Sequence[Float64Array], Sequence[Float64Array]]:
    """By seed, the expectations for the train scenes, and for the test scenes."""
    own = _of(chosen, group=group, method=method)
    by_split = [_of(own, split=split) for split in ("train", "test")]
    seeds = len(own["seed"].unique())
    expected = [numbers_in(one, "expected").astype(np.float64) for one in by_split]
    if [len(one) for one in expected] != [seeds * len(one.decided) for one in splits]:
        raise DamagedRecord(f"the choices by {method} are of other scenes than the table's; choose again")
    train, test = (np.split(one, seeds) for one in expected)
    return train, test


def _of(rows: pa.Table, **values: str) -> pa.Table:
    """The rows that have these values in the columns of these names."""
    fits = [np.array(rows[name].to_pylist()) == value for name, value in values.items()]
    return rows.filter(pa.array(np.logical_and.reduce(fits)))


def _way_scores(
    group: str,
    method: str,
    expected: tuple[Sequence[Float64Array], Sequence[Float64Array]],
    splits: tuple[Scenes, Scenes],
    samples: IntArray,
) -> WayScores:
    train, test = splits
    chosen = np.stack([test.chosen(one) for one in expected[1]])
    wrong = chosen > test.best
    by_seed = wrong.mean(axis=1)

    def of_people(values: Float64Array | BoolArray) -> Float64Array:
        return mean(values, test.person, samples)

    return WayScores(
        group=group,
        method=method,
        seeds=len(chosen),
        train_error=float(np.mean([train.chosen(one) > train.best for one in expected[0]])),
        error=figure(of_people(wrong.mean(axis=0))),
        lowest_error=float(by_seed.min()),
        highest_error=float(by_seed.max()),
        near_error=figure(of_people((chosen > test.best + NEAR).mean(axis=0))),
        share=figure(of_people(test.centre - chosen.mean(axis=0)) / of_people(test.centre - test.best)),
        uncertainty=figure(of_people(chosen.mean(axis=0))),
    )
