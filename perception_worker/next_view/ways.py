"""Every way of choosing, in the order of the table of results."""

from collections.abc import Iterator, Sequence

import numpy as np

from perception_worker.lifter.choice import shipped
from perception_worker.networks.models import OPENPOSE_MOBILENET_THIN, require_network
from perception_worker.next_view.arrays import CAMERAS, Arrays
from perception_worker.next_view.baselines import baselines
from perception_worker.next_view.choices import Choices
from perception_worker.next_view.classifiers import path_classifiers, thesis_classifiers
from perception_worker.next_view.error_map import BOUNDS, MAPS, error_maps
from perception_worker.next_view.people import lifted_joints
from perception_worker.next_view.picture_features import picture_features, principal_components


def all_choices(arrays: Arrays, seeds: Sequence[int]) -> Iterator[Choices]:
    """The choices of every way, with every seed, as each is fitted.

    Raises:
        ArtifactMissing, ArtifactDamaged: of the pose network.
        InvalidInput: a picture can't be read.
    """
    lifted = lifted_joints(arrays, shipped()[0])
    yield from baselines(arrays, lifted, seeds)
    features = picture_features(arrays.pictures, require_network(OPENPOSE_MOBILENET_THIN))
    yield from thesis_classifiers(arrays, principal_components(features, arrays.is_train), seeds)
    yield from path_classifiers(arrays, seeds)
    yield from error_maps(arrays, lifted, MAPS, seeds)
    true = np.repeat(arrays.joints[:, None], CAMERAS, axis=1)
    yield from error_maps(arrays, true, BOUNDS, seeds)
