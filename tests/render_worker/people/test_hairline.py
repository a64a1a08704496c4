import numpy as np
import pytest

from protocol.skeleton import Joint
from render_worker.people.hairline import fall_depth, hair_depth

FACE_JOINTS = (Joint.NOSE, Joint.LEFT_EYE, Joint.RIGHT_EYE, Joint.LEFT_EAR, Joint.RIGHT_EAR)


@pytest.fixture
def face(assets):
    return assets.rig.regressor.astype(float) @ assets.canonical.astype(float)


@pytest.mark.parametrize("length", [0.0, 0.035])
def test_the_face_stays_free_whatever_the_length(face, length):
    assert (hair_depth(face[list(FACE_JOINTS)], face, length) < 0).all()


def test_brow_and_cheek_stay_free(face):
    eye = face[Joint.LEFT_EYE]
    offsets = np.array([(0.005, 0.0, 0.016), (-0.01, 0.01, -0.02), (0.01, -eye[1], 0.02)])
    places = eye + offsets
    assert (hair_depth(places, face) < 0).all()


def test_the_crown_and_the_back_of_the_head_have_hair(face):
    ear, eye = face[Joint.LEFT_EAR], face[Joint.LEFT_EYE]
    crown = (ear[0], 0.0, eye[2] + 0.06)
    back = (ear[0] - 0.05, 0.0, eye[2])
    assert (hair_depth(np.array([crown, back]), face) > 0.01).all()


def test_longer_hair_reaches_lower_at_the_back_only(face):
    ear, nose = face[Joint.LEFT_EAR], face[Joint.NOSE]
    nape = np.array([ear[0] - 0.05, 0.0, nose[2] - 0.03])
    assert hair_depth(nape, face, 0.0) < 0 < hair_depth(nape, face, 0.03)


def test_long_hair_falls_behind_the_ears_and_nowhere_before_the_face(face):
    ear, nose = face[Joint.LEFT_EAR], face[Joint.NOSE]
    behind = np.array([ear[0] - 0.05, 0.0, nose[2] - 0.04])
    assert fall_depth(behind, face, 0.06) > 0 > fall_depth(behind, face, 0.02)
    assert (fall_depth(face[list(FACE_JOINTS)], face, 0.08) < 0).all()
