"""Lightning, imported in the one order that works beside a CPU-only PyTorch.

Lightning imports torchvision through torchmetrics, so torchvision's operators come first.
"""

from ngi.torchvision_operators import ensure_torchvision_operators

ensure_torchvision_operators()

from lightning import Callback, LightningDataModule, LightningModule, Trainer  # noqa: E402
from lightning.pytorch.plugins.io import TorchCheckpointIO  # noqa: E402

__all__ = ["Callback", "LightningDataModule", "LightningModule", "TorchCheckpointIO", "Trainer"]
