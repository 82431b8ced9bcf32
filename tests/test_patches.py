import pytest
import torch

from ngi.patches import BUFFER_CHANNELS, BufferLayout, Patches


def test_the_papers_buffers_have_13_channels_and_emission_3_more() -> None:
    assert BufferLayout().input_channels == 13
    assert BufferLayout().channels == 16


@pytest.mark.parametrize(
    "names", [tuple(BUFFER_CHANNELS), ("position",), ("position", "albedo", "emission")]
)
def test_slices_cover_all_channels_without_overlap(names: tuple[str, ...]) -> None:
    layout = BufferLayout(names)
    channels = [c for name in names for c in range(layout.channels)[layout.slice(name)]]
    assert channels == list(range(layout.channels))


@pytest.mark.parametrize("names", [(), ("normal",), ("albedo", "position"), ("position", "depth")])
def test_impossible_layouts_are_refused(names: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match="position"):
        BufferLayout(names)


def test_a_buffer_that_is_not_carried_is_named() -> None:
    with pytest.raises(KeyError, match="emission"):
        BufferLayout(("position",)).slice("emission")


def test_patches_are_indexed_and_concatenated_field_by_field() -> None:
    n = 5
    patches = Patches(
        scene_vector=torch.rand(n, 2),
        position=torch.rand(n, 2),
        resolution=torch.arange(n),
        large_step=torch.tensor([True, False, True, False, True]),
        buffers=torch.rand(n, 2, 2, 16),
        log_radiance=torch.rand(n, 2, 2, 3),
    )
    again = Patches.concatenate([patches[:2], patches[torch.tensor([2, 3, 4])]])
    for name, tensor in vars(patches).items():
        assert torch.equal(getattr(again, name), tensor)
    assert len(patches[1:3]) == 2
