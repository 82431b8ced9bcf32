"""The denoiser of Işık et al. 2021 (ANF), a competitor of the network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from ngi.methods.anf.affinity import spatial_weights, temporal_weights, warped, weighted_mean
from ngi.methods.anf.unet import UNet
from ngi.models.pixel_generator import RADIANCE_CHANNELS
from ngi.patches import BufferLayout

LARGEST_FEATURE = 8.0
SHARPNESS = 4.0
"""Bandwidths are in units of it: of the untrained network a and b are 4 ln 2."""


@dataclass(frozen=True)
class History:
    """What a frame leaves to the next one; [n, channels, H, W] each.

    embeddings, radiance: their running means ē and L̄; features: those of the last kernel;
    output: O, linear radiance
    """

    embeddings: Tensor
    radiance: Tensor
    features: Tensor
    output: Tensor

    def warped(self, source: Tensor) -> tuple[History, Tensor]:
        """This, where the next frame has it, and where that is known; see `affinity.warped`."""
        parts = [warped(part, source) for part in vars(self).values()]
        return History(*(part for part, _ in parts)), parts[0][1]


class AffinityDenoiser(nn.Module):
    """Denoises path-traced frames of a sequence by averages over alike pixels (Işık et al. 2021).

    A U-Net tells of each pixel, for each of K spatial kernels, features f, a bandwidth a and a
    central weight c, and one temporal bandwidth b and λ, from embeddings of the pixel and of where
    it was in the frame before (Eq. 1 to 3). Noisy radiance is accumulated over the frames with λ
    (Eq. 5), filtered by the kernels one after the other (Eq. 6), by the last one together with the
    output of the frame before (Eq. 8).

    layout: the buffers of the scene
    hidden_features: of the U-Net's coarsest levels; a quarter of it at full resolution, where
        there are as many features of an embedding, twice as many at each coarser level
    hidden_layers: convolutions of the U-Net, half of them on the way down: so many coarser levels
    affinity_features: numbers in f
    kernel_size, dilations: pixels of a kernel's side, odd, and how far they are apart in each

    It differs from their program in this: it sees pixels, means over their samples, not single
    samples; of those log1p radiance and the scene's buffers, without their split into diffuse and
    specular radiance, their depth and their flags; the sizes are those of the budget; features lie
    in [-8, 8], since those without bounds can grow within tens of steps until no two pixels are
    alike, where the gradient is 0 and the output is the input; a penalty of 1e-5 on the bandwidths
    is left out; it is trained from nothing, where the paper that we compare with starts from
    weights trained on other scenes.
    """

    def __init__(
        self,
        *,
        layout: BufferLayout,
        hidden_features: int = 128,
        hidden_layers: int = 8,
        affinity_features: int = 8,
        kernel_size: int = 5,
        dilations: Sequence[int] = (1, 2, 4, 8, 16),
    ) -> None:
        super().__init__()
        if hidden_features < 4 or hidden_layers < 2 or affinity_features < 1:
            raise ValueError(
                f"model.hidden_features is {hidden_features}, model.hidden_layers {hidden_layers}, "
                f"model.affinity_features {affinity_features}: expected at least 4, 2 and 1"
            )
        whole = all(isinstance(dilation, int) and dilation > 0 for dilation in dilations)
        if kernel_size < 3 or kernel_size % 2 == 0 or not dilations or not whole:
            raise ValueError(
                f"model.kernel_size is {kernel_size} and model.dilations {list(dilations)}: "
                "expected an odd number from 3 up, and a list of whole numbers from 1 up"
            )
        self.layout = layout
        self.kernel_size = kernel_size
        self.dilations = tuple(dilations)
        self.affinity_features = affinity_features
        first = hidden_features // 4
        widths = [min(first * 2**level, hidden_features) for level in range(hidden_layers // 2 + 1)]
        self.embedding = nn.ModuleList(
            nn.Conv2d(a, first, 1) for a in (layout.channels + RADIANCE_CHANNELS, first, first)
        )
        self.unet = UNet(
            inputs=2 * first,
            outputs=len(dilations) * (affinity_features + 2) + 2,
            widths=widths,
        )
        self._tell_pixels_apart()

    @torch.no_grad()
    def _tell_pixels_apart(self) -> None:
        """Makes the untrained kernels those of a joint bilateral filter.

        A filter whose features are the same everywhere is at rest: it averages all that its kernels
        reach, and the gradient of exp(−a |f_p − f_q|²) is 0 where f_p = f_q. PyTorch's initial
        weights make signals smaller layer by layer: across an edge a |f_p − f_q|² is 1e-5 then, and
        tens of steps change nothing. He et al. 2015 keep the size of the signals.
        """
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, a=0.01)  # the slope of leaky_relu
                assert module.bias is not None
                nn.init.zeros_(module.bias)
        of_features = len(self.dilations) * self.affinity_features
        self.unet.last.weight[of_features:] *= 0.1  # bandwidths and centres are alike at first

    def forward(self, buffers: Tensor, noisy: Tensor, sources: Tensor) -> Tensor:
        """log1p of linear RGB radiance of every frame, [n, frames, H, W, 3].

        buffers: [n, frames, H, W, C]; noisy: [n, frames, H, W, 3], log1p radiance as path-traced
        sources: [n, frames - 1, H, W] int64: of every frame but the first, the pixel of the frame
            before that each of its pixels was, counted row by row; negative for none
        Raises ValueError where these shapes do not fit.
        """
        self._check(buffers, noisy, sources)
        history: History | None = None
        outputs = []
        for frame in range(noisy.shape[1]):
            source = None if history is None else sources[:, frame - 1]
            history = self._denoise(buffers[:, frame], noisy[:, frame], source, history)
            outputs.append(history.output)
        return torch.log1p(torch.stack(outputs, dim=1).clamp(min=0)).movedim(2, -1)

    @torch.no_grad()
    def render(self, buffers: Tensor, noisy: Tensor, earlier: Tensor, sources: Tensor) -> Tensor:
        """The last frame of a sequence, [H, W, 3] log1p radiance.

        buffers: [H, W, C], its own; earlier: [frames - 1, H, W, C], those of the frames before
        noisy, sources: as of `forward`, without the axis n
        """
        frames = torch.cat([earlier, buffers[None]])
        output: Tensor = self(frames[None], noisy[None], sources[None])[0, -1]
        return output

    def _denoise(
        self, buffers: Tensor, noisy: Tensor, source: Tensor | None, history: History | None
    ) -> History:
        x = torch.cat([noisy, buffers], dim=-1).movedim(-1, 1)
        for layer in self.embedding:
            x = F.leaky_relu(layer(x))
        embeddings, radiance = x, torch.expm1(noisy).movedim(-1, 1)
        if history is None or source is None:
            earlier, known = None, None
            predicted = self.unet(torch.cat([embeddings, torch.zeros_like(embeddings)], dim=1))
        else:
            earlier, known = history.warped(source)
            predicted = self.unet(torch.cat([embeddings, earlier.embeddings], dim=1))
        with torch.autocast(x.device.type, enabled=False):
            return self._filter(radiance, embeddings.float(), predicted.float(), earlier, known)

    def _filter(
        self,
        radiance: Tensor,
        embeddings: Tensor,
        predicted: Tensor,
        earlier: History | None,
        known: Tensor | None,
    ) -> History:
        """predicted: the U-Net's; earlier, known: the frame before, warped, and where it is."""
        K, size = len(self.dilations), self.kernel_size
        features, a, c, b, λ = predicted.split([K * self.affinity_features, K, K, 1, 1], dim=1)
        features = LARGEST_FEATURE * torch.tanh(features / LARGEST_FEATURE)
        of_kernel = features.split(self.affinity_features, dim=1)
        a, c, b = SHARPNESS * F.softplus(a), torch.sigmoid(c), SHARPNESS * F.softplus(b)
        if earlier is not None and known is not None:
            λ = torch.sigmoid(λ) * known
            embeddings = torch.lerp(embeddings, earlier.embeddings, λ)
            radiance = torch.lerp(radiance, earlier.radiance, λ)
        filtered = radiance
        for k, dilation in enumerate(self.dilations):
            weights = spatial_weights(
                of_kernel[k], a[:, k : k + 1], c[:, k : k + 1], size=size, dilation=dilation
            )
            parts, dilations = [(filtered, weights)], [dilation]
            if k == K - 1 and earlier is not None:
                temporal = temporal_weights(of_kernel[k], earlier.features, b, known, size=size)
                parts, dilations = [*parts, (earlier.output, temporal)], [dilation, 1]
            filtered = weighted_mean(*parts, size=size, dilations=tuple(dilations))
        return History(embeddings, radiance, of_kernel[-1], filtered)

    def _check(self, buffers: Tensor, noisy: Tensor, sources: Tensor) -> None:
        n, frames, height, width, channels = buffers.shape
        if channels != self.layout.channels:
            raise ValueError(
                f"buffers of shape {list(buffers.shape)}: expected {self.layout.channels} channels "
                f"for {list(self.layout.names)}"
            )
        if noisy.shape != (n, frames, height, width, RADIANCE_CHANNELS) or sources.shape != (
            *(n, frames - 1, height, width),
        ):
            raise ValueError(
                f"buffers {list(buffers.shape)}, radiance {list(noisy.shape)} and sources "
                f"{list(sources.shape)}: expected those of the same frames and pixels"
            )
