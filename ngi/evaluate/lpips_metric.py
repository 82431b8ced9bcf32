"""LPIPS (Zhang et al. 2018) by the `lpips` package with AlexNet, never with random weights."""

import pickle
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import torch
from torch import Tensor, nn
from torch.overrides import TorchFunctionMode

from ngi.machine.torchvision_operators import ensure_torchvision_operators


class Lpips:
    """Learned perceptual distance of two images; 0 for equal ones.

    weights: file with torchvision's AlexNet state dict, whole or its `features` alone; None takes
        `alexnet-owt-7be5be79.pth` from PyTorch's hub cache. Nothing is ever downloaded.
    Raises ValueError for a configured file that is missing or holds something else.
    """

    def __init__(self, *, weights: Path | str | None) -> None:
        path = Path(weights) if weights else cached_weights()
        self.reason: str | None = None
        """Why there is no LPIPS, in one sentence that says how to get it; None where there is."""
        self._network: nn.Module | None = None
        if not weights and not path.exists():
            self.reason = _how_to_get_weights(path)
        else:
            self._network = _network(_convolutions(path))

    @property
    def available(self) -> bool:
        return self._network is not None

    def __call__(self, prediction: Tensor, reference: Tensor) -> float:
        """prediction, reference: [H, W, 3] sRGB in [0, 1], at least 31 x 31 pixels.

        Raises RuntimeError with the reason where LPIPS is not available.
        """
        if self._network is None:
            raise RuntimeError(self.reason)
        device = next(self._network.parameters()).device
        x, y = (
            image.to(device, torch.float32).permute(2, 0, 1).unsqueeze(0) * 2 - 1
            for image in (prediction, reference)
        )
        with torch.no_grad():
            distance: Tensor = self._network(x, y)
        return float(distance)


def cached_weights() -> Path:
    """Where PyTorch keeps them."""
    return Path(torch.hub.get_dir()) / "checkpoints" / "alexnet-owt-7be5be79.pth"


def _how_to_get_weights(path: Path) -> str:
    return (
        "no AlexNet weights for LPIPS: `python -m ngi.evaluate.lpips_download` downloads them to "
        f"{path}; or set NGI_LPIPS_WEIGHTS to a copy"
    )


def _convolutions(path: Path) -> dict[str, Tensor]:
    """AlexNet's convolution weights and biases, by their names in torchvision ('0.weight', …)."""
    try:  # mapped: of the whole state dict's 244 MB ten are used
        state: Any = torch.load(path, map_location="cpu", weights_only=True, mmap=is_zipfile(path))
    except FileNotFoundError as error:
        raise ValueError(f"LPIPS weights {path}: there is no such file") from error
    except (OSError, RuntimeError, EOFError, pickle.UnpicklingError) as error:
        raise ValueError(f"LPIPS weights {path} cannot be read: {error}") from error
    found = {}
    if isinstance(state, Mapping):
        found = {
            str(name).removeprefix("features."): value
            for name, value in state.items()
            if str(name).startswith("features.") or str(name)[:1].isdigit()
        }
    if not found:
        raise ValueError(
            f"LPIPS weights {path}: expected torchvision's AlexNet state dict or its features"
        )
    return found


class _Undrawn(TorchFunctionMode):
    """Layers made under it have memory for weights, and no weights in it yet."""

    def __torch_function__(
        self,
        func: Callable[..., Any],
        types: Any,
        args: tuple[Any, ...] = (),
        kwargs: dict[str, Any] | None = None,
    ) -> Any:
        given = kwargs or {}
        drawing = func in (nn.init.kaiming_uniform_, nn.init.uniform_)
        return given["tensor"] if drawing else func(*args, **given)


def _network(convolutions: dict[str, Tensor]) -> nn.Module:
    """The package's network with its own linear layers and the given AlexNet features."""
    ensure_torchvision_operators()
    # The package builds all of AlexNet first, of which 58 million random weights would be left
    # unused after a third of a second, and by a way torchvision calls deprecated.
    with _Undrawn(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import lpips

        network: nn.Module = lpips.LPIPS(net="alex", pnet_rand=True, verbose=False)
    # The package cuts AlexNet into slices and keeps the layers' numbers: slice2.3 is features.3.
    features = network.get_submodule("net")
    wanted = {name.split(".", 1)[1]: value for name, value in features.state_dict().items()}
    different = [
        name
        for name, value in wanted.items()
        if name not in convolutions or convolutions[name].shape != value.shape
    ]
    if different:
        raise ValueError(f"LPIPS weights: AlexNet's features lack {', '.join(different)}")
    features.load_state_dict(
        {name: convolutions[name.split(".", 1)[1]] for name in features.state_dict()}
    )
    return network.requires_grad_(False).eval()
