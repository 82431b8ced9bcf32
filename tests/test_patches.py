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


def test_patches_are_indexed_field_by_field() -> None:
    patches = Patches.blank(5, layout=BufferLayout(), dimensions=3, patch_size=4)
    patches.resolution[:] = torch.arange(5)
    assert patches.buffers.shape == (5, 4, 4, 16)
    assert patches[1:3].resolution.tolist() == [1, 2]
    assert patches[torch.tensor([4, 0])].resolution.tolist() == [4, 0]
    assert len(patches[1:3]) == 2
