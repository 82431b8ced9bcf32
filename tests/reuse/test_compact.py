import pytest
import torch

from ngi.patches import BufferLayout
from ngi.reuse import CompactPatches

LAYOUT = BufferLayout()


def round_trip(patches, layout=LAYOUT):
    return CompactPatches.compress(patches, layout).expand()


@pytest.mark.parametrize("names", [LAYOUT.names, ("position", "normal", "albedo"), ("position",)])
def test_all_but_half_precision_is_exact(make_patches, names) -> None:
    layout = BufferLayout(names)
    patches = make_patches(5, layout=layout)
    back = round_trip(patches, layout)
    for name in ("scene_vector", "position", "resolution", "large_step"):
        assert torch.equal(getattr(back, name), getattr(patches, name))
        assert getattr(back, name).dtype == getattr(patches, name).dtype
    where = layout.slice("position")
    assert torch.equal(back.buffers[..., where], patches.buffers[..., where])
    assert back.buffers.shape == patches.buffers.shape
    assert back.buffers.dtype == back.log_radiance.dtype == torch.float32
    torch.testing.assert_close(back.buffers, patches.buffers, atol=2.5e-4, rtol=0)


def rounding_error(make_patches, radiance):
    """Largest error of log radiance, over patches filled with these radiances."""
    patches = make_patches(1, size=round((len(radiance) / 3) ** 0.5))
    exact = radiance.log1p()
    patches.log_radiance.copy_(exact.float().reshape(patches.log_radiance.shape))
    return (round_trip(patches).log_radiance.double().flatten() - exact).abs().max().item()


def test_the_rounding_error_is_as_stated(make_patches) -> None:
    generator = torch.Generator().manual_seed(0)
    uniform = torch.rand(3 * 100 * 100, dtype=torch.float64, generator=generator)
    assert 3.7e-3 < rounding_error(make_patches, (uniform * 60_000).clamp_min(3000)) < 3.91e-3
    assert 4.7e-4 < rounding_error(make_patches, uniform * 6.38) < 4.89e-4
    assert rounding_error(make_patches, uniform * 1e-5) < 3.1e-8


def test_black_and_the_brightest_float_are_kept(make_patches) -> None:
    patches = make_patches(1)
    patches.log_radiance.zero_()
    patches.log_radiance[0, 0, 0, 0] = torch.tensor(torch.finfo(torch.float32).max).log1p()
    back = round_trip(patches).log_radiance
    assert back.count_nonzero() == 1
    assert back.max().item() == pytest.approx(88.72, rel=5e-4)


def test_expanded_patches_share_no_memory(make_patches) -> None:
    compact = CompactPatches.compress(make_patches(2), LAYOUT)
    before = {name: tensor.clone() for name, tensor in compact.tensors().items()}
    expanded = compact.expand()
    for tensor in vars(expanded).values():
        tensor.zero_()
    assert all(torch.equal(tensor, before[name]) for name, tensor in compact.tensors().items())


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 70_000.0])
@pytest.mark.parametrize(
    ("field", "name"), [("log_radiance", "log_radiance"), ("buffers", "other_buffers")]
)
def test_what_half_precision_cannot_hold_is_rejected(make_patches, value, field, name) -> None:
    patches = make_patches(3)
    getattr(patches, field)[1, 2, 3, -1] = value
    with pytest.raises(ValueError, match=rf"patches \[1\]: {name}"):
        CompactPatches.compress(patches, LAYOUT)


def test_a_position_that_is_no_number_is_rejected(make_patches) -> None:
    patches = make_patches(3)
    patches.buffers[2, 0, 0, 0] = float("nan")
    with pytest.raises(ValueError, match=r"patches \[2\]: world_position"):
        CompactPatches.compress(patches, LAYOUT)


def test_buffers_of_another_layout_are_rejected(make_patches) -> None:
    with pytest.raises(ValueError, match="16 channels"):
        CompactPatches.compress(make_patches(2), BufferLayout(("position", "normal")))


def test_patches_of_unequal_number_are_rejected(make_patches) -> None:
    patches = make_patches(3)
    patches.log_radiance.resize_(2, 4, 4, 3)
    with pytest.raises(ValueError, match="differ in number"):
        CompactPatches.compress(patches, LAYOUT)
