"""The views that an experiment is made of: who is seen in which pose, and from where.

A view depends on the experiment's seed and its own number alone, not on how many there are or on who asks for it.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Literal, TypeAlias

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.pictures.view import Viewpoint, camera_at
from protocol.camera import Camera, DepthNoise
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.messages import Sampled, SampleScene
from protocol.scene import TEST_IDENTITIES, TEST_POSES, TRAIN_IDENTITIES, TRAIN_POSES, Poses, Scene, Split

DISTANCE = (1.5, 9.0)
AZIMUTH = (-180.0, 180.0)
ALTITUDE = (1.0, 2.5)
"""What views are drawn from, evenly: metres along the ground, degrees from the front, metres above the ground."""

DRAWS_AT_ONCE, MOST_DRAWS = 64, 6400
"""Scenes drawn in a row, and before giving up on one with the wanted pose; one in six or eight has it."""

PoseSet: TypeAlias = Literal["kinds", "families"]
"""The poses of the people: the kinds of body pose of their split, or families that occur in no training."""

FAMILIES: tuple[Poses, ...] = ("overhead", "crossed", "squat", "kneel", "sit")

_FAMILY_SCENE = 0xFA31
"""Separates the random stream of a family's scene from that of a view."""

AskForScenes: TypeAlias = Callable[[Sequence[SampleScene]], Iterable[Sampled]]


class ViewSet(Struct, frozen=True, kw_only=True):
    """All the views of an experiment.

    Attributes:
        seed: the views follow from it.
        poses: of the people.
        depth_noises: each view is rendered once with each.
        views_a_scene: how many views in a row are of the same scene; drawing a new one takes as long as nine pictures.
        frames_a_part: how many are written at once; a kill loses at most these. Scenes are drawn for a part at a time.
    """

    frames: int = 5000
    split: Split = "test"
    seed: int = 0
    depth_noises: tuple[DepthNoise, ...] = ("none", "d435i")
    views_a_scene: int = 1
    frames_a_part: int = 250
    poses: PoseSet = "kinds"

    def __post_init__(self) -> None:
        if min(self.frames, self.views_a_scene, self.frames_a_part) < 1 or self.seed < 0:
            raise InvalidInput("an experiment has 1 frame or more, and a seed of 0 or more")
        if not self.depth_noises or len(set(self.depth_noises)) < len(self.depth_noises):
            raise InvalidInput("name one or more kinds of depth noise, each once")

    @property
    def words(self) -> str:
        """A description of the views, for messages."""
        noises = " and ".join(self.depth_noises)
        each = f"{self.views_a_scene} a scene, {self.frames_a_part} a part"
        families = ", families of poses" if self.poses == "families" else ""
        return f"{self.frames} frames of {self.split}, seed {self.seed}, {each}, depth noise {noises}{families}"


class View(Struct, frozen=True, kw_only=True):
    """One view.

    Attributes:
        number: from 0.
        identity: the person's.
        kind: of the person's pose; 0 in a family.
        poses: `kinds`, or the family.
    """

    number: int
    identity: int
    kind: int
    viewpoint: Viewpoint
    poses: Poses = "kinds"


class SeededScene(Struct, frozen=True):
    """A scene, and the seed that it was drawn from."""

    seed: int
    scene: Scene


def view(views: ViewSet, number: int) -> View:
    """View `number`: identities in turn, the next pose after each round of them, and a viewpoint of its own."""
    random = np.random.default_rng((views.seed, number))
    distance, azimuth, altitude = (float(random.uniform(*bounds)) for bounds in (DISTANCE, AZIMUTH, ALTITUDE))
    scene = number // views.views_a_scene
    identities, kinds = identities_and_poses(views.split)
    families = views.poses == "families"
    return View(
        number=number,
        identity=identities[scene % len(identities)],
        kind=0 if families else kinds[scene // len(identities) % len(kinds)],
        viewpoint=Viewpoint(distance=distance, angle=azimuth, altitude=altitude),
        poses=family_of(scene, views.split) if families else "kinds",
    )


def family_of(scene: int, split: Split) -> Poses:
    """The family of poses of scene `scene`: all in turn, and with each round of the identities one further."""
    identities, _ = identities_and_poses(split)
    return FAMILIES[(scene + scene // len(identities)) % len(FAMILIES)]


def identities_and_poses(split: Split) -> tuple[range, range]:
    """The identities of a split, and the kinds of their poses."""
    return (TEST_IDENTITIES, TEST_POSES) if split == "test" else (TRAIN_IDENTITIES, TRAIN_POSES)


def scenes_of(views: ViewSet, chosen: Sequence[View], ask: AskForScenes) -> Mapping[int, SeededScene]:
    """The scene of each view, by the view's number.

    The render workers draw the scenes, which then get the identities of their views. No scene depends on how many views
    follow.

    Raises:
        InvalidInput: the draws have too few poses of some kind.
    """
    first_of = {one.number // views.views_a_scene: one for one in reversed(chosen)}
    drawn = (_of_families if views.poses == "families" else _of_kinds)(views, first_of, ask)
    dressed = {scene: _dressed(drawn[scene], one) for scene, one in first_of.items()}
    return {one.number: dressed[one.number // views.views_a_scene] for one in chosen}


def _of_families(views: ViewSet, first_of: Mapping[int, View], ask: AskForScenes) -> dict[int, SeededScene]:
    """Scenes in families of poses, each with a seed of its own."""
    requests = [
        SampleScene(seed=family_seed(views, scene), split=views.split, poses=one.poses)
        for scene, one in sorted(first_of.items())
    ]
    answers = zip(sorted(first_of), requests, ask(requests), strict=True)
    return {scene: SeededScene(request.seed, answer.scene) for scene, request, answer in answers}


def _of_kinds(views: ViewSet, first_of: Mapping[int, View], ask: AskForScenes) -> dict[int, SeededScene]:
    """Scenes by kind of pose: from a sequence of draws, each takes the next draw with a pose of its kind."""
    first = first_of[min(first_of)]
    wanted = Counter(one.kind for one in first_of.values())
    drawn: dict[int, list[SeededScene]] = {kind: [] for kind in wanted}
    for batch in range(MOST_DRAWS // DRAWS_AT_ONCE):
        if all(len(drawn[kind]) >= count for kind, count in wanted.items()):
            left = {kind: iter(scenes) for kind, scenes in drawn.items()}
            return {scene: next(left[one.kind]) for scene, one in sorted(first_of.items())}
        draws = range(batch * DRAWS_AT_ONCE, (batch + 1) * DRAWS_AT_ONCE)
        requests = [SampleScene(seed=scene_seed(views, first, draw), split=views.split) for draw in draws]
        for request, answer in zip(requests, ask(requests), strict=True):
            drawn.setdefault(answer.scene.pose.kind, []).append(SeededScene(request.seed, answer.scene))
    raise InvalidInput(f"{MOST_DRAWS} scenes of {views.split} have too few of the wanted poses")


def _dressed(drawn: SeededScene, one: View) -> SeededScene:
    return replace(drawn, scene=replace(drawn.scene, identity=one.identity))


def scene_seed(views: ViewSet, first: View, draw: int) -> int:
    """The seed of draw number `draw` for the views that begin with `first`."""
    return int(np.random.default_rng((views.seed, first.number, draw)).integers(2**31))


def family_seed(views: ViewSet, scene: int) -> int:
    """The seed of scene `scene` in a family of poses."""
    return int(np.random.default_rng((views.seed, scene, _FAMILY_SCENE)).integers(2**31))


def camera_of(one: View, scene: Scene, environment: EnvironmentConfig, depth_noise: DepthNoise) -> Camera:
    """The camera of a view."""
    return replace(camera_at(one.viewpoint, scene, environment), depth_noise=depth_noise)
