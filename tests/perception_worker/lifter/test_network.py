import os
import subprocess
import sys

import numpy as np
import pytest

from perception_worker.lifter.network import OUTPUT_SIZE, LifterNetwork
from perception_worker.lifter.tokens import TOKEN_SIZE
from protocol.errors import ArtifactDamaged
from protocol.skeleton import JOINT_COUNT
from tests.perception_worker.lifter.bodies import SHAPE, weights


@pytest.fixture
def tokens() -> np.ndarray:
    return np.random.default_rng(1).normal(size=(3, JOINT_COUNT, TOKEN_SIZE)).astype(np.float32)


def test_computes_what_torch_does(tokens):
    torch = pytest.importorskip("torch")
    from perception_worker.lifter.fitting.model import LifterModel

    model = LifterModel(SHAPE).eval()
    with torch.no_grad():
        for name, weight in model.weights().items():
            weight.copy_(torch.from_numpy(weights()[name]))
        wanted = model(torch.from_numpy(tokens)).numpy()
    found = LifterNetwork(SHAPE, weights())(tokens)
    assert found.shape == (3, JOINT_COUNT, OUTPUT_SIZE)
    np.testing.assert_allclose(found, wanted, atol=2e-5)


def test_gives_the_same_bytes_for_the_same_tokens(tokens):
    network = LifterNetwork(SHAPE, weights())
    before = tokens.copy()
    assert network(tokens).tobytes() == network(tokens).tobytes()
    np.testing.assert_array_equal(tokens, before)


@pytest.mark.parametrize("wrong", ["missing", "shape", "nan"])
def test_refuses_weights_that_it_can_not_compute_with(wrong):
    arrays = weights()
    if wrong == "missing":
        del arrays["1.hidden"]
    elif wrong == "shape":
        arrays["1.hidden"] = arrays["1.hidden"].T
    else:
        arrays["1.hidden"][0, 0] = np.nan
    with pytest.raises(ArtifactDamaged, match=r"1\.hidden"):
        LifterNetwork(SHAPE, arrays)


@pytest.mark.slow
def test_its_bytes_do_not_depend_on_how_many_threads_there_are():
    digests = {_digest(threads) for threads in ("1", "2", "4")}
    assert len(digests) == 1


def _digest(threads: str) -> str:
    """Of what a network of the size that ships computes, in a process with so many threads for linear algebra."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    environment = os.environ | dict.fromkeys(names, threads)
    done = subprocess.run([sys.executable, "-c", _COMPUTE], env=environment, capture_output=True, text=True, check=True)
    return done.stdout


_COMPUTE = """
import hashlib
import numpy as np
from perception_worker.lifter.network import LifterNetwork, Shape
from perception_worker.lifter.tokens import TOKEN_SIZE
random, shape = np.random.default_rng(0), Shape()
weights = {name: (0.1 * random.normal(size=size)).astype(np.float32) for name, size in shape.parameters().items()}
network, digest = LifterNetwork(shape, weights), hashlib.sha256()
for _ in range(20):
    digest.update(network(random.normal(size=(2, 18, TOKEN_SIZE)).astype(np.float32)).tobytes())
print(digest.hexdigest())
"""
