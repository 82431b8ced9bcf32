"""What networks of buffers and scene vectors have to be given, and made with."""

from torch import Tensor

from ngi.patches import BufferLayout


def check_inputs(
    buffers: Tensor, scene_vector: Tensor, *, layout: BufferLayout, scene_dimensions: int
) -> None:
    """ValueError where these are not buffers [n, H, W, C] and scene vectors [n, D]."""
    if buffers.ndim != 4 or buffers.shape[-1] != layout.channels:
        raise ValueError(
            f"buffers of shape {list(buffers.shape)}: expected [n, H, W, "
            f"{layout.channels}] for {list(layout.names)}"
        )
    if scene_vector.shape != (len(buffers), scene_dimensions):
        raise ValueError(
            f"scene vector of shape {list(scene_vector.shape)}: expected "
            f"{[len(buffers), scene_dimensions]}"
        )


def check_sizes(*, hidden_features: int, hidden_layers: int) -> None:
    """ValueError for a network without a hidden layer, or with an empty one."""
    if hidden_features < 1 or hidden_layers < 1:
        raise ValueError(
            f"model.hidden_features is {hidden_features} and model.hidden_layers is "
            f"{hidden_layers}: both must be at least 1"
        )
