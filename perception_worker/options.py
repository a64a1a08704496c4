"""The command line of `python -m perception_worker`, and the configuration that it amends."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from msgspec.structs import replace

from protocol.config import FrameEncoding, RunConfig
from protocol.config_file import load_config, require_recorded_files
from protocol.named_files import with_absolute_paths
from protocol.security.options import add_security_options
from protocol.server.registration_settings import ADVERTISE_HELP
from protocol.telemetry.endpoint import add_http_options

_SECTION = "perception."
"""Of the configuration: this room's."""


def config_of(chosen: argparse.Namespace) -> RunConfig:
    """The run's configuration, amended by the command line.

    Raises:
        InvalidConfig: the file can't be read or is invalid, or a file that it records is another one.
    """
    config = RunConfig() if chosen.config is None else load_config(chosen.config)
    instead = {"network": chosen.network, "calibration": chosen.calibration, "frames": chosen.frames}
    given = {name: value for name, value in instead.items() if value is not None}
    instead_of = {f"{_SECTION}{name}" for name in given}
    amended = replace(
        config,
        perception=replace(config.perception, **given),
        artifacts={name: checksum for name, checksum in config.artifacts.items() if name not in instead_of},
    )
    require_recorded_files(amended, _SECTION)
    # Paths on the command line are relative to the working directory; the file's paths are absolute by now.
    return with_absolute_paths(amended, Path.cwd())


def options_of(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The parsed command line; exits with its error where it is wrong."""
    parser = argparse.ArgumentParser(
        prog="perception_worker", description="Estimates a person's 3D pose in frames, and how sure it is."
    )
    _add_addresses(parser)
    add_security_options(parser)
    _add_settings(parser)
    add_http_options(parser)
    chosen = parser.parse_args(arguments)
    if not chosen.render and not chosen.orchestrator:
        parser.error("which render workers draw the frames? Give --render, or --orchestrator, which names them")
    return chosen


def _add_addresses(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--bind", required=True, metavar="ADDRESS", help="where to serve, such as tcp://127.0.0.1:5556")
    parser.add_argument(
        "--render",
        action="append",
        default=[],
        metavar="ADDRESS",
        help="a render worker; may be repeated, and may be left out where there is an orchestrator",
    )
    parser.add_argument(
        "--orchestrator", metavar="ADDRESS", help="where to register, and to learn of render workers from"
    )
    parser.add_argument(
        "--name", default="perception", help="this worker's name at the orchestrator (default: perception)"
    )
    parser.add_argument("--advertise", metavar="ADDRESS", help=ADVERTISE_HELP)


def _add_settings(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--config", type=Path, metavar="FILE", help="the run's configuration (default: all defaults)")
    parser.add_argument(
        "--network", metavar="NAME|FILE", help="a name or an ONNX file, in place of the configuration's"
    )
    parser.add_argument(
        "--calibration",
        metavar="FILE|auto|none",
        help="source of errors in metres, in place of the configuration's: a file of 'orchestrator calibration fit', "
        "the shipped one that fits (auto), or nothing; a learned lifter has its own",
    )
    parser.add_argument(
        "--frames",
        choices=get_args(FrameEncoding),
        help="encoding of frames from render workers, in place of the configuration's: unpacked (none), packed without "
        "loss, as a JPEG, or lossless from other machines and none within this one (auto)",
    )
