import os
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from ngi.evaluate import Lpips

SHARED = Path(
    os.environ.get("NGI_LPIPS_DATA", Path(__file__).resolve().parents[3] / "shared" / "lpips")
)
needs_weights = pytest.mark.skipif(
    not (SHARED / "alexnet_features.pth").exists(),
    reason="set NGI_LPIPS_DATA to a folder with alexnet_features.pth and lpips' example imgs/",
)


def picture(name: str) -> torch.Tensor:
    with Image.open(SHARED / "imgs" / name) as image:
        return torch.from_numpy(np.array(image.convert("RGB"))).float() / 255


@needs_weights
def test_published_distances_of_the_example_pairs() -> None:
    state = torch.get_rng_state()
    lpips = Lpips(weights=SHARED / "alexnet_features.pth")
    assert torch.equal(state, torch.get_rng_state())
    reference = picture("ex_ref.png")
    assert lpips.available
    assert lpips.reason is None
    assert lpips(picture("ex_p0.png"), reference) == pytest.approx(0.722, abs=5e-4)
    assert lpips(picture("ex_p1.png"), reference) == pytest.approx(0.138, abs=5e-4)
    assert lpips(reference, reference) == 0.0
    reference[0, 0, 0] = torch.nan
    assert np.isnan(lpips(reference, reference))


@needs_weights
@pytest.mark.parametrize("whole", [True, False])
def test_whole_state_dict_and_features_alone_give_the_same(whole: bool, tmp_path: Path) -> None:
    features = torch.load(SHARED / "alexnet_features.pth", weights_only=True)
    if whole:
        content = {**features, "classifier.1.weight": torch.zeros(4, 4)}
    else:
        content = {name.removeprefix("features."): value for name, value in features.items()}
    torch.save(content, tmp_path / "alexnet.pth")
    pair = picture("ex_p0.png"), picture("ex_ref.png")
    assert Lpips(weights=tmp_path / "alexnet.pth")(*pair) == pytest.approx(0.722, abs=5e-4)


@needs_weights
def test_weights_in_the_hub_cache_are_found(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(torch.hub, "get_dir", lambda: str(tmp_path))
    (tmp_path / "checkpoints").mkdir()
    cached = tmp_path / "checkpoints" / "alexnet-owt-7be5be79.pth"
    cached.symlink_to(SHARED / "alexnet_features.pth")
    assert Lpips(weights=None).available


@pytest.mark.parametrize("unset", [None, ""])  # an environment variable that is there, but empty
def test_without_weights_it_says_how_to_get_them(
    tmp_path: Path, monkeypatch, unset: str | None
) -> None:
    monkeypatch.setattr(torch.hub, "get_dir", lambda: str(tmp_path))
    lpips = Lpips(weights=unset)
    assert not lpips.available
    assert lpips.reason is not None
    assert str(tmp_path / "checkpoints" / "alexnet-owt-7be5be79.pth") in lpips.reason
    with pytest.raises(RuntimeError, match="no AlexNet weights"):
        lpips(torch.zeros(64, 64, 3), torch.zeros(64, 64, 3))


def test_configured_file_that_is_wrong_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "weights.pth"
    with pytest.raises(ValueError, match=r"weights\.pth: there is no such file"):
        Lpips(weights=file)
    file.write_bytes(b"not a checkpoint")
    with pytest.raises(ValueError, match=r"weights\.pth cannot be read"):
        Lpips(weights=file)
    torch.save({"other": torch.zeros(3)}, file)
    with pytest.raises(ValueError, match=r"weights\.pth: expected torchvision's AlexNet"):
        Lpips(weights=file)
    torch.save({"features.0.weight": torch.zeros(3)}, file)
    with pytest.raises(ValueError, match=r"features lack 0\.weight"):
        Lpips(weights=str(file))
