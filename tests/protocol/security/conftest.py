"""A deployment with a key for every role."""

from pathlib import Path

import pytest

from tests.protocol.security.deployment import Deployment


@pytest.fixture
def deployment(tmp_path: Path) -> Deployment:
    return Deployment(tmp_path / "keys")
