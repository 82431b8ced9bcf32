"""A network as the content of an ONNX file, and what a program that embeds it has to know."""

import copy
import json
import logging
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import onnx
import onnxruntime
import torch
from torch import Tensor, nn

from ngi.learn import PatchSamples
from ngi.learn.supersampling import LEAST
from ngi.machine.provenance import provenance
from ngi.models import EncodedGenerator, PixelGenerator
from ngi.models.known_light import EMITTER_THRESHOLD
from ngi.patches import BufferLayout
from ngi.scene import SceneDescription
from ngi.view.bounce_rules import caustics_rule, specular_rule
from ngi.view.run_settings import read_settings
from ngi.view.trained_run import TrainedRun

ImageNetwork = PixelGenerator | EncodedGenerator
"""A network that tells radiance from the buffers of a pixel and from v."""
TRACED_PIXELS = 16
"""In the example that the network is traced with; the file takes any number."""

OPSET, FORMAT = 18, 8
"""Of ONNX, from 2023: the oldest that PyTorch's exporter writes, for the sake of older runtimes."""


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
            opset_version=OPSET,
        )
    assert program is not None
    model = program.model_proto
    model.ir_version = FORMAT
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


FLOAT32 = "32-true"
"""As Lightning names the precision of networks that are shown in float32."""
BUFFERS = {
    "position": "world position p of the hit: (p - minimum) / (maximum - minimum) of 'bounds'",
    "normal": "shading normal n in world space: n / 2 + 1 / 2",
    "outgoing": "unit vector from the surface towards the camera, world space, in [-1, 1]",
    "albedo": "linear RGB in [0, 1]: diffuse reflectance or base colour; of a conductor its "
    "specular_reflectance and not what its metal (eta, k) absorbs, of a dielectric its "
    "specular_transmittance; 1 where the scene's file gives the material none of these",
    "roughness": "alpha of GGX or Beckmann; 0 where perfectly smooth, 1 where diffuse",
    "throughput": "of the specular bounces before the surface, linear RGB; 1 where there is none",
    "chain_roughness": "sqrt of the sum of alpha^2 over these bounces",
    "direct": "log(1 + x) of the pixel's mean direct light x, linear RGB: the radiance that leaves "
    "the surface along 'outgoing' after one bounce from an emitter, times the throughput where "
    "that is a channel; trained on one emitter sample and one BSDF sample per camera ray, combined "
    "by multiple importance sampling; ",
    "emission": "log(1 + x) of the mean emitted radiance x of the pixel, linear RGB",
}
AFTER_BOUNCES = {
    "position": "world position p of the hit where the specular bounces end, see 'specular': "
    "(p - minimum) / (maximum - minimum) of 'bounds'",
    "outgoing": "unit vector from the surface back along the ray's last segment, world space, in "
    "[-1, 1]: towards the mirror or glass before it, the camera where there is none",
    "emission": "log(1 + x) of the mean emitted radiance x of the pixel, linear RGB: of every "
    "emitter on the ray's way, the environment too, times the throughput up to it",
}
"""What the channels of `BufferLayout` are; in `AFTER_BOUNCES` where specular bounces are traced."""
OTHER_BRANCH = (
    "; and of one that a dielectric's weaker branch meets first, times its weight too; but what a "
    "rough surface shows is in 'direct' instead, as sharp as if it were smooth"
)

PIXELS = (
    "each channel is the mean over the 'buffer_samples' camera rays of a pixel, spread evenly over "
    "its square; a ray that hits nothing, at once or in the end, counts as 0, "
    "but for its throughput, chain_roughness and emission"
)
RADIANCE = "linear RGB in the scene's units, as the network gives it: it may be slightly negative"
EDGES = (
    "at edges, where a component of a buffer differs by so much within 3 x 3 pixels, the program "
    "itself shows the mean radiance of the four quarters of a pixel, each with buffers of its own"
)
KNOWN_LIGHT = {
    (): "expm1(o)",
    ("emission",): "expm1(o + emission)",
    ("direct",): "expm1(o + direct)",
    ("direct", "emission"): "expm1(o + log1p(expm1(direct) + expm1(emission)))",
}
LINEAR = {
    ("emission",): "expm1(emission) + expm1(o)",
    ("direct", "emission"): "expm1(emission) + expm1(o + direct)",
}
"""The radiance, o being the network's own output in log1p space, by the channels there are; in
`LINEAR` emission is added to it as radiance."""
EMITTER = f"expm1(emission) in channels where emission > {EMITTER_THRESHOLD:g}, elsewhere "
ADDED = "; the file computes this itself, nothing is to be added to its radiance"
COMPONENTS = (
    "each variable's components of v follow those of the one before. u in [0, 1] stands for "
    "minimum + u * (maximum - minimum); a number whose minimum equals its maximum takes no "
    "component; with 'linked' one u moves all numbers. Of n choices u stands for number "
    "min(floor(n * u), n - 1). Keys and frames are spread evenly from 0 to 1. v is without what "
    "'left_out' names: it only places the camera, and where that is the buffers tell."
)


def network_metadata(run: TrainedRun, precision_differs: float) -> dict[str, str]:
    """By key, structures as JSON. Closed formulas have no bounds and no variables.

    precision_differs: how far what `TrainedRun.radiance` shows is from the network in float32,
        relative to 1 + radiance
    """
    assert isinstance(run.samples, PatchSamples)
    origin = provenance(backend=run.renderer.description)
    return {
        "scene": run.scene_name,
        "scene_hash": run.renderer.scene_hash,
        "step": str(run.step),
        "commit": f"{origin['commit'] or 'unknown'}{' (changed since)' if origin['dirty'] else ''}",
        "versions": json.dumps(origin["versions"]),
        "precision": _precision(run.precision, precision_differs),
        **_buffer_metadata(run),
        "pixels": PIXELS,
        "buffer_samples": str(run.renderer.buffer_samples),
        **(
            {"supersampled_edges": f"{EDGES}: {json.dumps(LEAST)}"}
            if run.samples.supersampled_edges
            else {}
        ),
        **(
            {}
            if run.description is None
            else scene_metadata(run.description, run.samples.components)
        ),
        "known_light": known_light(
            run.renderer.layout, linear=getattr(run.network, "linear_emission", False)
        ),
        "radiance": RADIANCE,
    }


def scene_metadata(description: SceneDescription, seen: Sequence[int]) -> dict[str, str]:
    """The box that positions count in, and the variables as scene.yaml has them, in order of v.

    seen: which components of v the network is given
    """
    low, high = description.bounds
    names = description.component_names
    kept = {names[number] for number in seen}
    variables = [
        {
            "components": [name for name in names[part] if name in kept],
            "kind": variable.kind,
            **asdict(variable),
        }
        for variable, part in description.parts()
        if kept.issuperset(names[part])
    ]
    return {
        "bounds": json.dumps({"minimum": low, "maximum": high}),
        "variables": json.dumps(variables),
        "left_out": json.dumps([name for name in names if name not in kept]),
        "v": COMPONENTS,
    }


def known_light(layout: BufferLayout, *, linear: bool) -> str:
    """How the light that the buffers tell becomes part of the radiance, see `add_known_light`."""
    names = tuple(name for name in ("direct", "emission") if name in layout.names)
    if linear and names in LINEAR:
        return f"{LINEAR[names]}{ADDED}"
    return f"{EMITTER if 'emission' in names else ''}{KNOWN_LIGHT[names]}{ADDED}"


def _precision(trained: str, differs: float) -> str:
    text = f"float32; trained as {trained}"
    if not differs:
        return text
    return (
        f"{text}, in which the program itself shows the network: its pictures differ from what "
        f"this file gives by up to {differs:.2g} of 1 + radiance"
    )


def _buffer_metadata(run: TrainedRun) -> dict[str, str]:
    """What was traced for the buffers, and what their channels are."""
    options = read_settings(run.folder)["renderer"]
    told = {f"renderer.{name}": options.get(name, "learned") for name in ("specular", "direct")}
    layout, direct = run.renderer.layout, told["renderer.direct"]
    max_depth = -1 if run.description is None else run.description.max_depth
    meanings = dict(BUFFERS)
    if "throughput" in layout.names:
        told["specular"] = specular_rule(max_depth)
        meanings |= AFTER_BOUNCES
        meanings["emission"] += "" if direct == "learned" else OTHER_BRANCH
    caustics = caustics_rule(max_depth) if direct == "with_caustics" else "caustics are not in it"
    meanings["direct"] += caustics
    return {**told, "buffers": json.dumps(list(_buffers(layout, meanings)))}


def _buffers(layout: BufferLayout, meanings: Mapping[str, str]) -> Iterable[dict[str, Any]]:
    """In order of the channels."""
    for name in layout.names:
        part = layout.slice(name)
        channels = part.stop - part.start
        yield {"name": name, "first": part.start, "channels": channels, "meaning": meanings[name]}
