"""A machine that looks as if it had a GPU, to the program and to Lightning."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
import torch
from torch import Tensor
from torch.nn.utils import clip_grad
from torch.optim import swa_utils

from ngi.patches import uploaded
from ngi.render.closed_form import ClosedFormRenderer
from ngi.render.protocol import RenderedPatches
from tests.gpu.pretended import (
    CPU,
    DEVICE,
    LEDGER,
    Gpu,
    Ledger,
    OnGpu,
    moved,
    on,
    pinned,
    waited,
)
from tests.gpu.pretended_graphs import GRAPHS

NAME = "NVIDIA Pretended"

PROBES: dict[str, Callable[..., Any]] = {
    "_lazy_init": lambda: None,
    "is_available": lambda: True,
    "is_initialized": lambda: True,
    "is_bf16_supported": lambda **_: True,
    "is_current_stream_capturing": lambda: False,
    "device_count": lambda: 1,
    "current_device": lambda: 0,
    "get_device_name": lambda *_: NAME,
    "get_device_capability": lambda *_: (9, 0),
    "get_device_properties": lambda *_: SimpleNamespace(
        name=NAME, uuid="0", major=9, minor=0, total_memory=2**36, multi_processor_count=132
    ),
    "mem_get_info": lambda *_: (2**36, 2**36),
    "set_device": lambda *_: None,
    "empty_cache": lambda: None,
    "synchronize": lambda *_: waited(),
    "get_rng_state_all": list,
    "set_rng_state_all": lambda *_: None,
    **GRAPHS,
}
"""What is asked of `torch.cuda` in a run, by the program and by Lightning."""


@contextmanager
def pretended_gpu() -> Iterator[Ledger]:
    """While it lasts there is a GPU, and closed formulas render on it as Mitsuba on a real one.

    Gives what the host asks of it.
    """
    with pytest.MonkeyPatch.context() as patch, Gpu():
        for name, answer in PROBES.items():
            patch.setattr(torch.cuda, name, answer)
        _patch_moves(patch)
        _patch_constants(patch)
        _patch_autocast(patch)
        _patch_renderers(patch)
        _patch_grouping(patch)
        # A module that moves would write into its parameters' memory, of which `OnGpu` has none.
        patch.setattr(torch.__future__, "_swap_module_params_on_conversion", True)
        LEDGER.clear()
        yield LEDGER
    torch.use_deterministic_algorithms(False)  # `make_repeatable` switches it on


def _patch_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    """To C++ both kinds of tensors are on the CPU, so that these would do nothing."""
    to, numpy, tolist = Tensor.to, Tensor.numpy, Tensor.tolist

    def to_device(self: Tensor, *args: Any, **kwargs: Any) -> Tensor:
        if args and isinstance(args[0], Tensor):
            args = (args[0].device, args[0].dtype, *args[1:])
        device, dtype, non_blocking, *_ = torch._C._nn._parse_to(
            *args, **{k: v for k, v in kwargs.items() if k not in ("copy", "memory_format")}
        )
        if device is None or (device.type == "cuda") == on(self):
            kwargs.pop("device", None)
            rest = [a for a in args if not isinstance(a, str | torch.device)]
            return to(self, *rest, **kwargs) if rest or kwargs else self
        return moved(self, device.type == "cuda", dtype or self.dtype, waits=not non_blocking)

    def to_numpy(self: Tensor, *, force: bool = False) -> Any:
        if not on(self):
            return numpy(self, force=force)
        if not force:
            raise TypeError("can't convert cuda:0 device type tensor to numpy. Use Tensor.cpu()")
        return numpy(to_device(self.detach(), CPU))

    monkeypatch.setattr(Tensor, "to", to_device)
    monkeypatch.setattr(Tensor, "cpu", lambda self: to_device(self, CPU))
    monkeypatch.setattr(Tensor, "cuda", lambda self, *_: to_device(self, DEVICE))
    monkeypatch.setattr(Tensor, "pin_memory", lambda self: pinned(self))
    monkeypatch.setattr(Tensor, "numpy", to_numpy)
    monkeypatch.setattr(Tensor, "tolist", lambda self: tolist(to_device(self.detach(), CPU)))
    monkeypatch.setattr(OnGpu, "data_ptr", lambda self: self.numbers.data_ptr())


def _patch_constants(monkeypatch: pytest.MonkeyPatch) -> None:
    """Made of Python's numbers without asking the dispatcher."""

    def on_device(make: Callable[..., Tensor]) -> Callable[..., Tensor]:
        def made(*args: Any, device: Any = None, **kwargs: Any) -> Tensor:
            made = make(*args, **kwargs)
            return made if device is None else made.to(device)

        return made

    for name in ("tensor", "as_tensor"):
        monkeypatch.setattr(torch, name, on_device(getattr(torch, name)))


def _patch_autocast(monkeypatch: pytest.MonkeyPatch) -> None:
    """Autocast for 'cuda' is that for the CPU, where C++ takes the tensors to be."""
    made = torch.autocast.__init__
    enabled, dtype = torch.is_autocast_enabled, torch.get_autocast_dtype

    def make(
        self: Any, device_type: str, dtype: Any = None, enabled: bool = True, *rest: Any, **how: Any
    ) -> None:
        assert device_type == "cuda" or not enabled, "autocast for the CPU, on a GPU"
        made(self, "cpu", dtype, enabled, *rest, **how)

    monkeypatch.setattr(torch.autocast, "__init__", make)
    monkeypatch.setattr(torch, "is_autocast_enabled", lambda *_: enabled("cpu"))
    monkeypatch.setattr(torch, "get_autocast_dtype", lambda *_: dtype("cpu"))


def _patch_renderers(monkeypatch: pytest.MonkeyPatch) -> None:
    render_patches = ClosedFormRenderer.render_patches

    def patches_on_gpu(self: ClosedFormRenderer, states: Tensor, **how: Any) -> RenderedPatches:
        rendered = render_patches(self, states, **how)
        buffers, log_radiance = (
            uploaded(images, DEVICE) for images in (rendered.buffers, rendered.log_radiance)
        )
        return replace(rendered, buffers=buffers, log_radiance=log_radiance)

    def on_gpu(render: Callable[..., Tensor]) -> Callable[..., Tensor]:
        return lambda *what, **how: render(*what, **how).to(DEVICE)

    monkeypatch.setattr(ClosedFormRenderer, "render_patches", patches_on_gpu)
    for name in ("render_image", "image_buffers", "pixel_buffers"):
        monkeypatch.setattr(ClosedFormRenderer, name, on_gpu(getattr(ClosedFormRenderer, name)))


def _patch_grouping(monkeypatch: pytest.MonkeyPatch) -> None:
    """C++ groups gradients and weights by the device that it takes them to be on."""
    group = clip_grad._group_tensors_by_device_and_dtype

    def grouped(lists: list[list[Tensor]], *rest: Any) -> dict[tuple[Any, Any], Any]:
        return {
            (members[0][0].device, dtype): (members, indices)
            for (_, dtype), (members, indices) in group(lists, *rest).items()
        }

    for module in (clip_grad, swa_utils):
        monkeypatch.setattr(module, "_group_tensors_by_device_and_dtype", grouped)
