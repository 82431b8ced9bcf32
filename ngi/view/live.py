"""The page of a run that trains: pictures are made between its steps, while its clock stands."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import pandas as pd
import torch
import viser
from torch import Tensor

from ngi.evaluate import EvaluationProtocol
from ngi.learn import Run
from ngi.learn.lightning_api import Callback
from ngi.scene import SceneDescription
from ngi.view.page import Page
from ngi.view.studio import Studio
from ngi.view.subject import subject
from ngi.view.training_figure import Axis, Visited, training_figure

log = logging.getLogger(__name__)

SHARE = 0.5
"""Most of the wall time that the page takes."""
REFRESH = 5.0
"""Seconds between two pictures of the training, at least."""
FIRST = -1.0
"""Place of a folder above all others; viser counts up from 0 as parts are added."""
HARDEST = 8
KEPT_BATCHES = 60
"""Generated batches whose proposals are shown."""
WHOLE = 1_000_000
"""Bytes up to which a log is read as a whole; those of long runs have gigabytes."""
PICKED = 1000
"""Rows that are read of a larger one, about twice as many as are drawn."""


class LiveView(Callback):
    """Shows the network as it is, and what the run does, to all browsers that look at `page`.

    Nothing that training depends on is changed. The clock stands still meanwhile, as in an
    evaluation, and for each second spent here a second is trained.

    variables: names of the components of v
    """

    def __init__(self, run: Run, *, page: Page, studio: Studio, variables: Sequence[str]) -> None:
        self._run = run
        self._page = page
        self._studio = studio
        self._panel = TrainingPanel(page.gui, axes(variables))
        self._visited: deque[tuple[Tensor, Tensor]] = deque(maxlen=KEPT_BATCHES)
        self._free_from = self._refresh_from = 0.0
        self._closed = False

    def on_train_batch_end(self, *_: Any) -> None:
        self._remember()
        begin = monotonic()
        if begin < self._free_from or not self._page.visitors:
            return
        due = begin >= self._refresh_from
        if not (due or self._studio.waiting):
            return
        self._run.stream.catch_up()
        with self._run.clock.phase("evaluate"):
            if due:
                self._studio.network_changed()
                self._try_to_refresh()
                self._refresh_from = monotonic() + REFRESH
            self._studio.work(wait=0)
        spent = monotonic() - begin
        self._free_from = monotonic() + spent * (1 / SHARE - 1)

    def on_train_end(self, *_: Any) -> None:
        self.close()

    def close(self) -> None:
        """Frees the port; nothing happens the second time."""
        if not self._closed:
            self._closed = True
            self._page.close()

    def _remember(self) -> None:
        record = self._run.stream.chain_record
        if record is not None and "position" in record:
            states = torch.from_numpy(np.asarray(record["position"]))
            self._visited.append((states, torch.from_numpy(record["target_proposed"])))

    def _try_to_refresh(self) -> None:
        try:
            self._refresh()
        except Exception:
            log.exception("the viewer could not draw the training; training continues")

    def _refresh(self) -> None:
        store, current = self._run.stream.store, self._run.stream.chains.position
        ids, losses = store.hardest(HARDEST)
        self._run.folder.steps.flush()
        states, densities = zip(*self._visited, strict=True) if self._visited else ((), ())
        empty = torch.empty(0, current.shape[1])
        self._panel.show(
            evaluations=_rows(self._run.folder.metrics.path),
            steps=_rows(self._run.folder.steps.path),
            visited=Visited(
                torch.cat([empty, *states]), torch.cat([torch.empty(0), *densities]), current
            ),
            patches=first_images(self._run.samples.example(store.get(ids))[1]),
            losses=losses.tolist(),
        )


def live_view(
    run: Run,
    *,
    scene_name: str,
    description: SceneDescription | None,
    protocol: EvaluationProtocol,
    port: int,
) -> LiveView:
    """The page of a run, served on this machine at `port` until the training ends.

    description: of the scene; None for closed formulas
    """
    about = subject(
        name=f"{scene_name}, training",
        folder=run.folder.path,
        description=description,
        renderer=run.renderer,
        protocol=protocol,
        scene=None,
        supersampled_edges=False,
    )

    def predict(buffers: Tensor, v: Tensor, *, preview: bool) -> Tensor:
        inputs = run.samples.test_inputs(v, buffers, preview=preview)
        return run.module.predict(buffers, *inputs)

    studio = Studio(renderer=run.renderer, predict=predict)
    page = Page(studio, about, resolution=protocol.resolution, host="127.0.0.1", port=port)
    log.info("watch the training at %s", page.where)
    if description is None:
        variables: Sequence[str] = [f"{control.group} {control.name}" for control in about.controls]
    else:
        variables = description.component_names
    return LiveView(run, page=page, studio=studio, variables=variables)


class TrainingPanel:
    """A folder of the page that all browsers share."""

    def __init__(self, gui: viser.GuiApi, axes: Sequence[Axis]) -> None:
        self._axes = {axis.name: axis for axis in axes}
        components = list(self._axes)
        with gui.add_folder("Training", order=FIRST):
            self._across = gui.add_dropdown("chains, across", components)
            self._up = gui.add_dropdown("chains, up", components, initial_value=components[1])
            self._image = gui.add_image(np.full((8, 8, 3), 255, np.uint8), format="png")

    def show(self, **what: Any) -> None:
        """what: arguments of `training_figure` but for the axes, which browsers choose."""
        self._image.image = training_figure(
            across=self._axes[self._across.value], up=self._axes[self._up.value], **what
        )


def axes(variables: Sequence[str]) -> list[Axis]:
    """The components of v, and the patch position, which is at the end of every method's states."""
    patch = [Axis("patch x", -2), Axis("patch y", -1)]
    return [*(Axis(name, index) for index, name in enumerate(variables)), *patch]


def first_images(radiance: Tensor) -> Tensor:
    """[n, P, P, 3], the first image of each of [n, …, P, P, 3], which is that of its v."""
    return radiance.flatten(1, -4)[:, 0] if radiance.ndim > 4 else radiance


def _rows(path: Path) -> pd.DataFrame:
    """What of a log is on the disk; of one larger than `WHOLE`, `PICKED` rows far and wide."""
    size = path.stat().st_size if path.exists() else 0
    if size <= WHOLE:
        return pd.read_csv(path) if size else pd.DataFrame()
    with path.open("rb") as stream:
        picked = [stream.readline()]
        for place in np.linspace(stream.tell(), size, PICKED, endpoint=False):
            stream.seek(int(place))
            stream.readline()  # what is left of the row that begins before
            if (row := stream.readline()).endswith(b"\n"):
                picked.append(row)
    return pd.read_csv(BytesIO(b"".join(picked)))
