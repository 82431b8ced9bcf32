"""Shows a trained network in the browser: `ngi view --help`."""

import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from ngi.config.options import option, run_tool
from ngi.files.extras import install_command

POLL = 0.5
"""Seconds to wait for something to do, after which Ctrl-C is looked at."""


@dataclass
class ViewOptions:
    """Shows a trained network in the browser, with a slider for every variable of the scene.

    ngi view run=outputs/demo/sphere-caustic/method=uniform/seed=0

    Over SSH: ssh -L 8080:127.0.0.1:8080 MACHINE, then open http://127.0.0.1:8080 here.
    """

    run: str = option("a run's folder, finished or not")
    resolution: int = option("initial pixels a side", 256)
    supersampled_edges: bool = option(
        "evaluate the network four times per pixel at edges: still pictures take longer",
        False,
    )
    port: int = option("of the page; if it is taken, a later one", 8080)
    host: str = option("0.0.0.0 lets in everybody who can reach this machine", "127.0.0.1")
    scene: str | None = option("folder of the scene, if it is one of the paper's authors", None)


def view(options: ViewOptions) -> None:
    """Serves the page until Ctrl-C."""
    try:
        from ngi.view.page import Page
    except ModuleNotFoundError as error:
        raise RuntimeError(f"ngi view needs {error.name}: {install_command('viewer')}") from error
    from ngi.view.studio import Studio
    from ngi.view.subject import subject
    from ngi.view.trained_run import TrainedRun

    if options.resolution < 1:
        raise ValueError(f"resolution: {options.resolution}: give at least 1")
    run = TrainedRun.open(
        Path(options.run),
        scene_path=options.scene,
        supersampled_edges=options.supersampled_edges,
    )
    studio = Studio(renderer=run.renderer, predict=run.predict)
    shown = subject(
        name=f"{run.scene_name}, step {run.step:,}",
        folder=run.folder,
        description=run.description,
        renderer=run.renderer,
        protocol=run.protocol,
        scene=options.scene,
        supersampled_edges=options.supersampled_edges,
    )
    with (
        closing(run.renderer),
        closing(
            Page(studio, shown, resolution=options.resolution, host=options.host, port=options.port)
        ) as page,
    ):
        print(f"{page.where}; end with Ctrl-C", flush=True)
        while True:
            studio.work(wait=POLL)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi view`."""
    return run_tool(view, ViewOptions, "ngi view", arguments)


if __name__ == "__main__":
    sys.exit(main())
