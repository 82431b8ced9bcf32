"""A network as the content of an ONNX file, and how far what that gives is from the network."""

from __future__ import annotations

import copy
import logging
import warnings
from collections.abc import Mapping

import onnx
import onnxruntime
import torch
from torch import Tensor, nn

from ngi.models import EncodedGenerator, PixelGenerator

ImageNetwork = PixelGenerator | EncodedGenerator
"""A network that tells radiance from the buffers of a pixel and from v."""
TRACED_PIXELS = 16
"""In the example that the network is traced with; the file takes any number."""


class PixelRadiance(nn.Module):
    """A network for pixels in any order, all at one v, in linear radiance.

    v, [1, D], makes one bias per layer that sees it, however many pixels there are.
    """

    def __init__(self, network: ImageNetwork) -> None:
        super().__init__()
        self.network = network

    def forward(self, buffers: Tensor, v: Tensor) -> Tensor:
        """[N, C] and [D] to [N, 3], linear RGB, possibly negative."""
        log_radiance: Tensor = self.network(buffers[None, :, None], v[None])
        return torch.expm1(log_radiance[0, :, 0])


def network_file(network: ImageNetwork, metadata: Mapping[str, str]) -> bytes:
    """Of an ONNX file with inputs 'buffers' [pixels, C] and 'v' [D], output 'radiance' [pixels, 3].

    metadata: of the file as a whole, which every runtime hands out
    """
    logging.getLogger("onnxscript").setLevel(logging.ERROR)  # warns of splits left to the runtime
    example = (
        torch.zeros(TRACED_PIXELS, network.layout.channels),
        torch.zeros(network.scene_dimensions),
    )
    with warnings.catch_warnings(), torch.no_grad():
        warnings.simplefilter("ignore")  # of what PyTorch's exporter itself calls
        program = torch.onnx.export(
            _in_linear_radiance(network),
            example,
            dynamo=True,
            verbose=False,
            input_names=["buffers", "v"],
            output_names=["radiance"],
            dynamic_shapes={"buffers": {0: "pixels"}, "v": None},
        )
    assert program is not None
    model = program.model_proto
    _forget_origins(model.graph)
    onnx.helper.set_model_props(model, dict(metadata))
    content: bytes = model.SerializeToString()
    return content


def largest_difference(content: bytes, network: ImageNetwork, buffers: Tensor, v: Tensor) -> float:
    """Between what ONNX Runtime and PyTorch make of [N, C] and [D], relative to 1 + |radiance|."""
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    [radiance] = session.run(None, {"buffers": buffers.numpy(), "v": v.numpy()})
    with torch.no_grad():
        expected = _in_linear_radiance(network)(buffers, v)
    return relative_difference(torch.from_numpy(radiance), expected)


def relative_difference(radiance: Tensor, expected: Tensor) -> float:
    """The largest, in units of 1 + |radiance|, of linear radiance of one shape."""
    return float(((radiance - expected).abs() / (1 + expected.abs())).max())


def _in_linear_radiance(network: ImageNetwork) -> PixelRadiance:
    return PixelRadiance(copy.deepcopy(network).cpu()).eval()


def _forget_origins(graph: onnx.GraphProto) -> None:
    """The exporter notes beside every node which line of which file on this machine it is from."""
    for entry in (*graph.node, *graph.input, *graph.output, *graph.value_info, *graph.initializer):
        entry.ClearField("metadata_props")
        entry.ClearField("doc_string")
    graph.ClearField("metadata_props")
