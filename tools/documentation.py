"""Writes the pages of the documentation that follow from the program; a hook of MkDocs.

`python tools/documentation.py` prints them. Only PyYAML is needed: neither Hydra nor PyTorch.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT))

from ngi.cli import WAY, overview  # noqa: E402

GROUPS = {
    "scene": "What varies. Every scene folder is an option too: see Scenes.",
    "method": "The paper's method, ours, ablations and competitors, as options of other groups.",
    "sampler": "Which states are proposed, and which of them the chains accept.",
    "reuse": "When to train on stored patches again, and on which.",
    "resolution": "Of the images that patches are cut from, over the course of training.",
    "data": "What a training sample is.",
    "model": "The network.",
    "loss": "Between the network's log1p radiance and the path tracer's.",
    "optimizer": "Of the network's weights.",
    "schedule": "Of the learning rate, over the run.",
    "averaging": "Of the weights that are evaluated and shown.",
    "budget": "The size of a run, and how long it takes.",
    "evaluation": "Test frames, references and metrics.",
    "renderer": "What traces the patches.",
    "trainer": "Lightning's trainer: the precision.",
    "tracker": "Where the run's progress is logged, in addition to its own files.",
    "path_tracing": "Path tracing in place of the network; chosen by `method`.",
    "experiment": "What a sweep changes beyond its methods and scenes.",
}


def on_files(files: Any, config: Any) -> Any:
    """MkDocs asks for further pages here."""
    from mkdocs.structure.files import File

    for name, content in pages().items():
        files.append(File.generated(config, f"reference/{name}.md", content=content))
    return files


def pages() -> dict[str, str]:
    """Markdown by name."""
    return {"commands": commands(), "options": options()}


def commands() -> str:
    """What `ngi --help` prints, and where each verb is explained."""
    rows = [f"| `ngi {verb.name}` | {verb.help} |" for verbs in WAY.values() for verb in verbs]
    table = "\n".join(["| command | what for |", "| --- | --- |", *rows])
    return (
        f'# Commands\n\n```text title="ngi --help"\n{overview()}\n```\n\n'
        "`ngi VERB --help` shows a verb's options. `report` and `gpu-check` take `--flags`; all "
        "others take `key=value`. `train` and `costs` also take Hydra's `group=option` "
        "([Groups and options](options.md)), and `train` also `--dry-run`. With the other verbs "
        "you can omit the first key: `ngi describe mirror` means `ngi describe scene=mirror`.\n\n"
        f"{table}\n\n"
        "Further programs, for studies of the method itself, run as modules: "
        "`python -m ngi.studies.noise`, `python -m ngi.studies.exploration_map` with "
        "`python -m analysis.exploration_map`, `python -m ngi.studies.ceiling` with "
        "`python -m analysis.ceiling`, `python -m analysis.endurance`.\n\n"
        "The exit status is 0 on success, 130 after Ctrl-C, 143 after SIGTERM, and otherwise 1 or "
        "2. From `describe`, `doctor`, `metrics` and `stability`, 1 means that a problem was "
        "found, 2 that nothing could be checked; from `gpu-check`, 3 means that there is more to "
        "measure.\n"
    )


def options() -> str:
    """A section per group of conf/, with the comment and the content of every option."""
    found = {path.name for path in (ROOT / "conf").iterdir() if path.is_dir()} - {"hydra"}
    if found != GROUPS.keys():
        raise ValueError(f"conf/ and GROUPS in {Path(__file__).name} differ: {found ^ set(GROUPS)}")
    lines = [
        "# Groups and options",
        "",
        "Choose with `group=option`, change one value with `key=value`: "
        "`ngi train sampler=uniform sampler.chains=32`. `ngi train --cfg job --resolve …` shows "
        "the configuration that a command line yields. This page is generated from `conf/`.",
        "",
        "## The whole",
        "",
        "`conf/train.yaml`: the paper's settings. A command that names neither `method` nor "
        "`budget` gets `method=ours budget=machine`.",
        "",
        *_block((ROOT / "conf" / "train.yaml").read_text().split("\nlabel:")[0]),
    ]
    for group, purpose in GROUPS.items():
        lines += ["", f"## {group}", "", purpose]
        folder = ROOT / "conf" / group
        for file in sorted(folder.rglob("*.yaml")):
            option = file.relative_to(folder).with_suffix("")
            lines += ["", f"### {group}={option}", "", *_option(file)]
    lines += ["", "## sweeps", "", "Started by `ngi train -m +sweeps=NAME`.", ""]
    lines += ["| sweep | what it compares |", "| --- | --- |"]
    for file in sorted((ROOT / "sweeps").glob("*.yaml")):
        lines.append(f"| `{file.stem}` | {_comment(file)} |")
    return "\n".join(lines) + "\n"


def _option(file: Path) -> Iterator[str]:
    if comment := _comment(file):
        yield from (comment, "")
    content = "\n".join(line for line in file.read_text().splitlines() if not line.startswith("#"))
    yield from _block(content)


def _block(content: str) -> list[str]:
    yaml.safe_load(content)  # a page of what cannot be read would help nobody
    return ["```yaml", content.strip(), "```"]


def _comment(file: Path) -> str:
    """The comment at the top, without Hydra's header and the command."""
    lines = []
    for line in file.read_text().splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.removeprefix("#").strip())
    text = " ".join(line for line in lines if not line.startswith(("@package", "python -m")))
    return re.sub(r"(?<!`)\b(conf|docs|scenes)/[\w./-]+", r"`\g<0>`", text).replace("|", "\\|")


if __name__ == "__main__":
    for page in pages().values():
        print(page)
