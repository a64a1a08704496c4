import subprocess
import zipfile

import pytest

from protocol.errors import ArtifactDamaged, Unavailable
from render_worker.baking import photographs


def test_a_photograph_with_another_checksum_is_refused(tmp_path, monkeypatch):
    wheel = tmp_path / "images.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("skimage/data/brick.png", b"something else")
    monkeypatch.setattr(photographs, "_download", lambda directory: wheel)
    with pytest.raises(ArtifactDamaged, match="brick"):
        photographs.fetch_photographs()


def test_a_failed_download_says_what_pip_said(monkeypatch):
    failed = subprocess.CompletedProcess([], 1, stdout="", stderr="one line\nno route to host\n")
    monkeypatch.setattr(photographs.subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(Unavailable, match="no route to host"):
        photographs.fetch_photographs()
