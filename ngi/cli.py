"""One command for the whole program: `ngi VERB …`, or `python -m ngi VERB …`.

A verb is a module with a function `main`, which is imported when its verb is asked for: `ngi
--help` waits for neither PyTorch nor Mitsuba.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module

import ngi
from ngi.config.unread_output import readers_may_leave


@dataclass(frozen=True)
class Verb:
    """A word of the command line. module: with `main()`, which reads sys.argv."""

    name: str
    module: str
    help: str


WAY = {
    "First": (
        Verb("doctor", "ngi.commands.doctor", "check what this machine can render and train with"),
        Verb("train", "ngi.train", "train a network or a sweep of runs; resumes where it stopped"),
        Verb(
            "report",
            "analysis.report",
            "compare runs: tables, plots, verdicts on the paper's claims",
        ),
    ),
    "Look at a run": (
        Verb(
            "view", "ngi.view.__main__", "show it in the browser, with a slider for every variable"
        ),
        Verb(
            "render", "ngi.view.picture", "render one picture of any configuration, as PNG or EXR"
        ),
        Verb(
            "video",
            "ngi.view.video",
            "film a path through the scene and measure temporal stability",
        ),
        Verb("export", "ngi.view.export", "save the network as one ONNX file, for other programs"),
    ),
    "Scenes": (
        Verb(
            "describe",
            "ngi.view.describe",
            "list what varies in a scene, or could, and what is wrong",
        ),
        Verb("gallery", "ngi.view.gallery", "make a contact sheet of every scene"),
    ),
    "Measure": (
        Verb(
            "costs",
            "ngi.studies.costs",
            "measure what steps cost here, for a fair run time in training",
        ),
        Verb("metrics", "ngi.commands.metrics", "recompute metrics from a run's linear pictures"),
        Verb(
            "benchmark",
            "ngi.studies.benchmark.__main__",
            "measure how fast every part of the program is",
        ),
        Verb(
            "gpu-check",
            "ngi.studies.gpu_check.__main__",
            "take every measurement of a GPU, in parts",
        ),
        Verb("stability", "ngi.studies.stability.__main__", "test extreme and stiff cases"),
    ),
}
"""The verbs, in the order in which one meets them."""

VERBS = {verb.name: verb for verbs in WAY.values() for verb in verbs}


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi` and `python -m ngi`; the verb's exit status, 2 where there is none.

    arguments: those of the command line where None
    """
    with readers_may_leave():
        return _run(arguments)


def _run(arguments: Sequence[str] | None) -> int:
    name, *rest = [*(sys.argv[1:] if arguments is None else arguments)] or [""]
    if name in ("-h", "--help", "help"):
        print(overview())
        return 0
    if name == "--version":
        print(f"ngi {ngi.__version__}")
        return 0
    if name not in VERBS:
        print(_unknown(name) if name else overview(), file=sys.stderr)
        return 2
    sys.argv = [f"ngi {name}", *rest]
    status: int | None = import_module(VERBS[name].module).main()
    return status or 0


def overview() -> str:
    """What `ngi --help` prints."""
    lines = ["Neural global illumination of variable scenes.", ""]
    lines += ["  ngi VERB …          runs a verb", "  ngi VERB --help     shows its options"]
    for title, verbs in WAY.items():
        lines += ["", f"{title}:", *(f"  {verb.name:<11}{verb.help}" for verb in verbs)]
    return "\n".join(lines)


def _unknown(name: str) -> str:
    meant = get_close_matches(name, VERBS, n=1, cutoff=0.0)[0]
    return f"ngi: there is no '{name}'; did you mean 'ngi {meant}'? ngi --help lists every verb"
