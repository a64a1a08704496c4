"""From a table and the choices that were made of it to scores, a page and a plot on disk."""

import msgspec

from orchestrator.experiments.next_view.directory import NextViewDirectory
from orchestrator.experiments.next_view.page import page
from orchestrator.experiments.next_view.plot import scores_plot
from orchestrator.experiments.next_view.scores import NextViewScores, scores_of
from orchestrator.experiments.pages.plots import write
from protocol.artifact import whole_file


def publish(directory: NextViewDirectory) -> NextViewScores:
    """Compute the scores, and write them, their page and their plot.

    Raises:
        DamagedRecord: the choices are of other scenes.
    """
    scores = scores_of(directory.table_path, directory.choices_path, directory.views().spacing)
    with whole_file(directory.scores_path) as aside:
        aside.write_bytes(msgspec.json.format(msgspec.json.encode(scores), indent=2) + b"\n")
    with whole_file(directory.page_path) as aside:
        aside.write_text(page(scores), encoding="utf-8")
    write(directory.plots / "next-view.png", scores_plot(scores))
    return scores
