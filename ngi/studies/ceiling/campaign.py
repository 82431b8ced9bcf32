"""All runs of a scene, resumable, into one folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pandas as pd
import torch
from hydra.utils import instantiate
from omegaconf import DictConfig
from torch import Tensor
from tqdm import tqdm

from ngi.config.build import build_samples, plain
from ngi.evaluate import Evaluator
from ngi.explore import Importance
from ngi.files.durable import write_atomically, write_tensors
from ngi.learn import Samples
from ngi.machine.memory import keep_freed_memory
from ngi.reuse import CompactPatches
from ngi.studies import provenance
from ngi.studies.ceiling.choices import CHUNK, Choice, Oracle
from ngi.studies.ceiling.pool import check_count, chosen, render_pool
from ngi.studies.ceiling.runs import Run, do, measured, plan
from ngi.studies.ceiling.training import Training

TABLE, TEACHER = "ceiling.csv", "teacher.pt"

TEACHER_SEED = 1000
"""Of the network that stands in for the truth; no run has it."""


def run_all(config: DictConfig) -> Path:
    """Does the runs that the folder does not hold yet; the path of the table of all of them.

    Raises ValueError for a folder whose runs were made with another scene or configuration.
    """
    study, folder = config.ceiling, Path(config.run.folder)
    runs = list(
        plan(
            pool=study.pool,
            sizes=plain(study)["sizes"],
            rounds=study.rounds,
            choices=list(study.choices),
            seeds=study.seeds,
        )
    )
    keep_freed_memory()
    samples, evaluator, pool = _rendered(config, folder)
    truth = _truth(config, samples, pool, evaluator, folder)
    _file(folder, runs[0]).parent.mkdir(exist_ok=True)
    for run in tqdm(runs, desc="runs", unit="run"):
        if not _file(folder, run).exists():
            training = Training(
                config, samples=samples, seed=run.seed, steps=run.steps, folder=folder
            )
            row = do(
                run,
                training,
                pool=pool,
                truth=truth,
                choice=_choice(study.choices[run.choice], training, pool, truth),
                rounds=study.rounds,
                evaluator=evaluator,
            )
            table = pd.DataFrame([{"scene": config.scene.name, **row}])
            write_atomically(_file(folder, run), table.to_csv(index=False).encode())
    table = pd.concat([pd.read_csv(_file(folder, run)) for run in runs], ignore_index=True)
    write_atomically(folder / TABLE, table.to_csv(index=False).encode())
    return folder / TABLE


def _choice(option: DictConfig, training: Training, pool: CompactPatches, truth: Tensor) -> Choice:
    """Of one run. An option that only says how values count is an oracle's."""
    made: Importance | Callable[..., Choice] = instantiate(option)
    if isinstance(made, Importance):
        return Oracle(made, training=training, pool=pool, truth=truth)
    return made(training=training, pool=pool, truth=truth)


def _rendered(config: DictConfig, folder: Path) -> tuple[Samples, Evaluator, CompactPatches]:
    """Samples, an evaluator that has its references, and the pool, all that takes a renderer.

    Raises ValueError as `claim` and `check_count` do, and for a store that draws by losses.
    """
    sampler, count = instantiate(config.sampler), config.ceiling.pool
    check_count(count, sampler)
    with closing(instantiate(config.renderer)) as renderer:
        store = instantiate(config.reuse.store)(layout=renderer.layout)
        if store.draws_by_loss:
            raise ValueError(
                "reuse: its store draws patches by their losses, which this study does not record; "
                "give reuse=by_samples"
            )
        if store.capacity < count:
            raise ValueError(
                f"reuse.store.capacity: a store of {store.capacity} patches does not hold the pool "
                f"of {count}; give reuse=by_samples, or a smaller ceiling.pool"
            )
        claim(folder, config, scene=renderer.scene_hash, backend=renderer.description)
        samples = build_samples(config, renderer=renderer)
        evaluator = instantiate(config.evaluation.evaluator)(
            renderer=renderer, test_inputs=samples.test_inputs
        )
        evaluator.prepare()
        pool = render_pool(
            folder / "pool",
            samples=samples,
            sampler=sampler,
            resolution=instantiate(config.resolution).resolution(0),
            count=count,
        )
    return samples, evaluator, pool


def _truth(
    config: DictConfig,
    samples: Samples,
    pool: CompactPatches,
    evaluator: Evaluator,
    folder: Path,
) -> Tensor:
    """[m, h, w, 3]: what a network of the same kind answers that was trained long on all patches.

    Its own errors are written beside it.
    """
    file = folder / TEACHER
    if not file.exists():
        steps = config.ceiling.teacher_steps
        teacher = Training(config, samples=samples, seed=TEACHER_SEED, steps=steps, folder=folder)
        for part in torch.arange(len(pool)).split(CHUNK):
            teacher.add(chosen(pool, part), torch.ones(len(part), dtype=torch.float64))
        for _ in tqdm(range(steps), desc="teacher", unit="step"):
            teacher.train(1)
        errors = measured(evaluator.evaluate(teacher.predict))
        write_atomically(folder / "teacher.json", json.dumps(errors, indent=1).encode())
        parts = torch.arange(len(pool)).split(CHUNK)
        write_tensors(
            file, {"answers": torch.cat([teacher.answers(chosen(pool, part)) for part in parts])}
        )
    answers: Tensor = torch.load(file, weights_only=True)["answers"]
    return answers


def _file(folder: Path, run: Run) -> Path:
    return folder / "runs" / f"{run.name}.csv"


PARTS = (
    *("data", "sampler", "reuse", "resolution", "model", "loss", "optimizer", "schedule"),
    *("averaging", "trainer", "renderer"),
)
"""Of the configuration, that decide what a run of the study gives."""

NOT_OF_PATCHES = ("scene", "workers", "cluster")
"""Of the renderer's: where the scene lies, which is told by its hash, and who renders."""

IN_EVERY_RUN = ("pool", "rounds", "teacher_steps")
"""Of the study's own; how many runs there are may change."""


def claim(folder: Path, config: DictConfig, *, scene: str, backend: str) -> None:
    """As `ngi.studies.provenance.claim`; a choice may be added. scene: hash of all its files."""
    study = plain(config.ceiling)
    configuration = {part: plain(config[part]) for part in PARTS}
    for key in NOT_OF_PATCHES:
        configuration["renderer"].pop(key, None)
    made_with = {
        "scene": scene,
        "study": {key: study[key] for key in IN_EVERY_RUN},
        "configuration": configuration,
        "protocol": plain(config.evaluation.evaluator.protocol),
        **{f"choice {name}": choice for name, choice in study["choices"].items()},
    }
    provenance.claim(folder, made_with, backend=backend, option="run.folder")
