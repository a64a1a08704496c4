import pytest

from orchestrator.experiments.figures.bootstrap import Figure
from orchestrator.experiments.figures.lifting_figures import LiftedJoints
from orchestrator.experiments.figures.observation_figures import Coverage, QoeFigures, Score
from orchestrator.experiments.targets.observation_targets import targets
from orchestrator.experiments.targets.target import Target


def told(value: float) -> Figure:
    return Figure(value, value, value)


def lifted(group: str, sort: str, error: float, coverage: float, *, noise: str = "none", joints: int = 9):
    return LiftedJoints(
        noise=noise,
        group=group,
        sort=sort,
        joints=joints,
        share=told(0.5),
        error=told(error),
        radius=told(2 * error),
        coverage=told(coverage),
    )


def score(uncertainty: str) -> Score:
    names = ("located_raw", "located_clipped", "all_raw", "all_clipped", "joint_raw", "joint_clipped", "joint_spearman")
    figures = {name: told(0.6 + index / 100) for index, name in enumerate((*names, "joint_auroc"))}
    return Score(noise="none", band="all", uncertainty=uncertainty, frames=9, joints=9, wrong=0.1, **figures)


def figures(poses: str, *own: LiftedJoints, coverage: tuple[Coverage, ...] = ()) -> QoeFigures:
    return QoeFigures(
        frames=9,
        people=1,
        split="test",
        poses=poses,
        seed=0,
        network="net",
        lifting="learned",
        scores=(score("quality, mean"), score("expected error")),
        coverage=coverage,
        errors=(),
        lifted=own,
    )


def of_joint(joint: str, value: float) -> Coverage:
    return Coverage(noise="none", band="all", joint=joint, joints=9, coverage=told(value), radius=told(0.1))


@pytest.fixture
def in_kinds() -> dict[tuple[str, str], Target]:
    own = (
        lifted("all", "all", 0.05, 0.93),
        lifted("all", "seen", 0.05, 0.86),
        lifted("all", "wrists", 0.11, 0.9),
        lifted("all", "inferred", 0.09, 0.84),
        lifted("under 3 m", "all", 0.05, 0.87),
        lifted("5 to 9 m", "all", 0.05, 0.84),
        lifted("kind 6", "seen", 0.05, 0.9),
        lifted("kind 7", "seen", 0.061, 0.9),
        lifted("all", "seen", 0.065, 0.8, noise="d435i"),
        lifted("all", "all", 0.07, 0.85, noise="d435i"),
    )
    coverage = (of_joint("all", 0.93), of_joint("nose", 0.95), of_joint("left wrist", 0.88))
    return {(one.words, one.noise): one for one in targets(figures("kinds", *own, coverage=coverage))}


def test_targets_in_the_kinds(in_kinds):
    assert {(*name, round(one.value, 9), one.met) for name, one in in_kinds.items() if "thesis" not in one.words} == {
        ("mean error, m: seen joints", "none", 0.05, True),
        ("mean error, m: seen wrists", "none", 0.11, False),
        ("mean error, m: inferred joints", "none", 0.09, True),
        ("the greatest mean error of an unseen kind of pose, m: seen joints (kind 7)", "none", 0.061, False),
        ("mean error, m: seen joints", "d435i", 0.065, True),
        ("median radius, m: seen joints", "none", 0.1, True),
        ("coverage of the 90% radius", "none", 0.93, False),
        ("the least coverage of a joint (left wrist)", "none", 0.88, True),
        ("the least coverage of a band (5 to 9 m)", "none", 0.84, False),
        ("coverage: seen joints", "none", 0.86, True),
        ("coverage: inferred joints", "none", 0.84, False),
        ("coverage: all joints", "d435i", 0.85, True),
        ("expected error: ρ of frames, seen joints, raw", "none", 0.6, False),
        ("expected error: AUROC of a seen joint's error above 0.10 m", "none", 0.67, False),
    }


def test_the_thesis_s_claim_is_held_against_every_table(in_kinds):
    assert in_kinds["thesis's quality: ρ of frames, all joints, clipped", "none"].value == pytest.approx(0.63)
    found = [one.words for one in targets(figures("families", lifted("sit", "seen", 0.06, 0.9)))]
    assert found[0] == "thesis's quality: ρ of frames, all joints, clipped"


def test_targets_in_families_are_those_of_the_worst_one():
    own = [lifted(family, sort, 0.05, 0.85) for family in ("crossed", "kneel") for sort in ("all", "seen")]
    own += [lifted("sit", "seen", 0.071, 0.7), lifted("sit", "all", 0.09, 0.79), lifted("all", "seen", 0.2, 0.2)]
    error, coverage = [one for one in targets(figures("families", *own)) if "thesis" not in one.words]
    assert (error.words, error.value, error.high) == (
        "the greatest mean error of a family, m: seen joints (sit)",
        0.071,
        0.07,
    )
    assert (coverage.words, coverage.value, coverage.low) == ("the least coverage of a family (sit)", 0.79, 0.8)
    assert not error.met
    assert not coverage.met


def test_what_no_joint_was_lifted_of_is_no_target():
    found = list(targets(figures("kinds", lifted("all", "inferred", float("nan"), float("nan"), joints=0))))
    assert not any("inferred" in one.words for one in found)
