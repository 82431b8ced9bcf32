"""Makes torchvision importable next to a torch build that its compiled part does not fit.

torchvision's compiled part of the default package index is built for CUDA; next to a CPU-only torch
it does not load, and `import torchvision` then fails with "operator torchvision::nms does not
exist", and with it `import lpips`, `torchmetrics` and `lightning`. None of them calls the
operators here, they only have to be declared.
"""

import importlib.util
import sys
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, FileFinder

import torch

_SIGNATURES = (
    "nms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor",
    "qnms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor",
)

# The declarations last as long as the library object does.
_declared: list[torch.library.Library] = []


def ensure_torchvision_operators() -> None:
    """Declares torchvision's two operators, only where its compiled part fails to load.

    Call it before the first import of lpips, torchmetrics or lightning. It neither imports
    torchvision nor changes anything where that is absent, already imported or sound, and may be
    called any number of times. A declared operator has no kernel: calling it raises
    NotImplementedError.
    """
    if _declared or "torchvision" in sys.modules or _compiled_part_loads():
        return
    library = torch.library.Library("torchvision", "DEF")
    for signature in _SIGNATURES:
        library.define(signature)
    _declared.append(library)


def _compiled_part_loads() -> bool:
    """Whether there is no torchvision to repair, or one whose compiled part fits this torch."""
    package = importlib.util.find_spec("torchvision")
    if package is None or not package.submodule_search_locations:
        return True
    folder = package.submodule_search_locations[0]
    extension = FileFinder(folder, (ExtensionFileLoader, EXTENSION_SUFFIXES)).find_spec("_C")
    if extension is None or extension.origin is None:
        return False
    try:
        # What torchvision itself does at import; loading a library a second time does nothing.
        torch.ops.load_library(extension.origin)
    except (ImportError, OSError):
        return False
    return True
