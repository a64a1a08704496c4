"""`orchestrator view`: pictures of scenes as the drone would see them."""

from pathlib import Path
from typing import Annotated

import typer

from orchestrator.cli.options import at_work, examples
from orchestrator.terminal.output import print_line
from protocol.artifact import require_place
from protocol.scene import Split

view_app = typer.Typer()


@view_app.command(
    "view",
    epilog=examples(
        "orchestrator view 7",
        "orchestrator view 7 --distance 2.5 --angle 30 --output handover.png",
        "orchestrator view 1 2 3 --split train --output pictures/",
    ),
)
def view_scenes(
    scenes: Annotated[list[int], typer.Argument(metavar="SCENE...", help="The scenes' seeds.", show_default=False)],
    split: Annotated[Split, typer.Option(help="Of whose people.")] = "test",
    distance: Annotated[float, typer.Option(help="Metres from the person, along the ground.")] = 3.0,
    angle: Annotated[float, typer.Option(help="Degrees from the person's front; 90 is at their left.")] = 0.0,
    altitude: Annotated[float, typer.Option(help="Metres above the ground.")] = 1.6,
    bystanders: Annotated[int, typer.Option(help="How many more people are there, 0 to 8.")] = 0,
    size: Annotated[str | None, typer.Option(help="Of the camera's picture.", show_default="640x480")] = None,
    config: Annotated[Path | None, typer.Option(help="A configuration for the workers and the camera.")] = None,
    output: Annotated[
        Path | None, typer.Option(help="A file, or a directory for many scenes.", show_default="scene-SEED.png")
    ] = None,
) -> None:
    """Draw what the drone would see of scenes: colour, depth, heatmaps, the skeleton, and its joints in space."""
    # OpenCV and Pillow take their time to load, and no other command needs them.
    from orchestrator.pictures import view as viewing

    viewpoint = viewing.Viewpoint(distance=distance, angle=angle, altitude=altitude)
    look = viewing.Look(seeds=tuple(dict.fromkeys(scenes)), split=split, viewpoint=viewpoint, bystanders=bystanders)
    settings = viewing.view_config(config, size)
    files = viewing.picture_files(look.seeds, output)
    for file in files.values():
        # Before anybody draws.
        require_place(file)

    def write(seed: int, page: viewing.UInt8Array) -> None:
        viewing.write_picture(files[seed], page)
        print_line(files[seed])

    with at_work() as (display, stop):
        viewing.view(look, settings, show=write, display=display, stop=stop)
