"""Lightning, imported in the one order that works beside a CPU-only PyTorch.

Lightning imports torchvision through torchmetrics, so torchvision's operators come first.
"""

import logging
import warnings

from ngi.machine.torchvision_operators import ensure_torchvision_operators

ensure_torchvision_operators()

from lightning import Callback, LightningDataModule, LightningModule, Trainer  # noqa: E402
from lightning.fabric.plugins.environments.lightning import LightningEnvironment  # noqa: E402
from lightning.pytorch.plugins.io import TorchCheckpointIO  # noqa: E402
from lightning.pytorch.utilities.exceptions import SIGTERMException  # noqa: E402

# Lightning announces hardware, tips and stops at every run; ours are in result.json and the log.
logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)
# Resuming in the middle of the endless epoch is what datamodule and stream are made for; that it
# is exact is tested (tests/learn/test_resume.py).
warnings.filterwarnings("ignore", message=".*your dataloader is not resumable")
# Lightning 2.6.6 uses a name that PyTorch 2.13 deprecates; nothing of ours is concerned.
warnings.filterwarnings("ignore", message=r"`isinstance\(treespec, LeafSpec\)` is deprecated")

__all__ = ["Callback", "LightningDataModule", "LightningEnvironment", "LightningModule"]
__all__ += ["SIGTERMException", "TorchCheckpointIO", "Trainer"]
