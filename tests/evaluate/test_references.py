import dataclasses
import logging
import os

import numpy as np
import pytest
import torch

from ngi.evaluate import ReferenceCache, mape, relative_noise
from ngi.evaluate.references import Reference, read_reference

V = torch.tensor([0.25, 0.5, 0.75])


def test_noise_is_the_standard_error_relative_to_radiance(renderer, protocol, tmp_path) -> None:
    protocol = dataclasses.replace(protocol, resolution=128)
    reference = ReferenceCache(tmp_path).get(renderer, protocol, V)
    truth = renderer.truth(V, 128)
    standard_error = renderer.noise / reference.samples_per_pixel**0.5
    expected = (standard_error / (truth + protocol.epsilon)).mean().item()
    assert reference.noise == pytest.approx(expected, rel=0.02)
    assert reference.noise <= protocol.target_noise
    measured_error = (reference.radiance - truth).std().item()
    assert measured_error == pytest.approx(standard_error, rel=0.02)


def test_floor_is_the_error_of_the_reference_itself(renderer, protocol, tmp_path) -> None:
    protocol = dataclasses.replace(protocol, resolution=128)
    reference = ReferenceCache(tmp_path).get(renderer, protocol, V)
    floor = mape(reference.half_a, reference.radiance, protocol.epsilon)
    perfect = mape(renderer.truth(V, 128), reference.radiance, protocol.epsilon)
    assert floor == pytest.approx(perfect, rel=0.02)


def test_references_hold_no_buffers(renderer, protocol, tmp_path) -> None:
    ReferenceCache(tmp_path).get(renderer, protocol, V)
    assert renderer.buffer_passes == 0
    (file,) = tmp_path.iterdir()
    with np.load(file) as content:
        assert "buffers" not in content


def test_rendering_stops_at_the_noise_or_at_the_sample_limit(renderer, protocol, tmp_path) -> None:
    cache = ReferenceCache(tmp_path)
    passes: list[tuple[int, float]] = []
    good = cache.get(renderer, protocol, V, on_pass=lambda *p: passes.append(p))
    assert [samples for samples, _ in passes] == [128 * (i + 1) for i in range(len(passes))]
    assert all(noise > protocol.target_noise for _, noise in passes[:-1])
    assert passes[-1] == (good.samples_per_pixel, good.noise)
    limited = dataclasses.replace(protocol, target_noise=1e-6, maximum_samples=300)
    stopped = cache.get(renderer, limited, V)
    assert stopped.samples_per_pixel == 256
    assert stopped.noise > limited.target_noise


def test_seeds_of_passes_halves_and_frames_differ(renderer, protocol, tmp_path) -> None:
    cache = ReferenceCache(tmp_path)
    cache.get(renderer, protocol, V)
    cache.get(renderer, protocol, V.flip(0))
    assert len(renderer.seeds) > 8
    assert len(set(renderer.seeds)) == len(renderer.seeds)


def test_cached_reference_is_the_same_and_not_rendered_again(renderer, protocol, tmp_path) -> None:
    first = ReferenceCache(tmp_path).get(renderer, protocol, V)
    renderer.seeds.clear()
    renderer.description = "another backend"
    again = ReferenceCache(tmp_path).get(renderer, protocol, V)
    assert not renderer.seeds
    assert again.backend == "closed formula"
    for name in ("half_a", "half_b"):
        assert torch.equal(getattr(first, name), getattr(again, name))
    assert (again.noise, again.samples_per_pixel) == (first.noise, first.samples_per_pixel)
    assert again.content_hash == first.content_hash


@pytest.mark.parametrize("change", ["scene", "vector", "protocol"])
def test_whatever_decides_the_picture_decides_the_name(
    renderer, protocol, tmp_path, change: str
) -> None:
    cache = ReferenceCache(tmp_path)
    first = cache.get(renderer, protocol, V)
    if change == "scene":
        renderer.scene_hash = "another"
    elif change == "protocol":
        protocol = dataclasses.replace(protocol, samples_per_pass=32)
    other = cache.get(renderer, protocol, V + 1e-7 if change == "vector" else V)
    assert other.key != first.key
    assert len(list(tmp_path.iterdir())) == 2


def test_protocols_that_differ_elsewhere_share_references(renderer, protocol, tmp_path) -> None:
    cache = ReferenceCache(tmp_path)
    cache.get(renderer, protocol, V)
    renderer.seeds.clear()
    cache.get(renderer, dataclasses.replace(protocol, name="b", exposure=1.0, sobol_seed=5), V)
    assert not renderer.seeds


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "foreign"])
def test_damaged_file_is_rendered_again(renderer, protocol, tmp_path, caplog, damage) -> None:
    cache = ReferenceCache(tmp_path)
    first = cache.get(renderer, protocol, V)
    (file,) = tmp_path.iterdir()
    content = bytearray(file.read_bytes())
    if damage == "cut":
        content = content[: len(content) // 2]
    elif damage == "flipped":
        content[len(content) // 2] ^= 0xFF
    elif damage == "empty":
        content = bytearray()
    else:
        cache.get(renderer, protocol, V.flip(0))
        (other,) = set(tmp_path.iterdir()) - {file}
        content = bytearray(other.read_bytes())
    file.write_bytes(content)
    with caplog.at_level(logging.WARNING):
        again = cache.get(renderer, protocol, V)
    assert file.name in caplog.text
    assert again.content_hash == first.content_hash
    assert ReferenceCache(tmp_path).get(renderer, protocol, V).content_hash == first.content_hash


def test_failed_write_leaves_nothing_behind(renderer, protocol, tmp_path, monkeypatch) -> None:
    def no_space(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(np, "savez_compressed", no_space)
        with pytest.raises(OSError, match="No space"):
            ReferenceCache(tmp_path).get(renderer, protocol, V)
    assert not list(tmp_path.iterdir())


def test_one_reference_may_be_written_twice_at_once(
    renderer, protocol, tmp_path, monkeypatch
) -> None:
    """By two processes of the same number, in containers that share the cache."""
    save, writes = np.savez_compressed, []

    def meanwhile(*arguments: object, **named: object) -> None:
        writes.append(1)
        if len(writes) == 1:
            ReferenceCache(tmp_path).get(renderer, protocol, V)
        save(*arguments, **named)

    monkeypatch.setattr(np, "savez_compressed", meanwhile)
    reference = ReferenceCache(tmp_path).get(renderer, protocol, V)
    assert len(writes) == 2
    (file,) = tmp_path.iterdir()
    renderer.seeds.clear()
    assert (
        ReferenceCache(tmp_path).get(renderer, protocol, V).content_hash == reference.content_hash
    )
    assert not renderer.seeds, f"{file} was not read"


@pytest.mark.parametrize("links", [True, False], ids=["hard links", "none"])
def test_of_two_that_differ_both_processes_have_the_cached_one(
    renderer, protocol, tmp_path, monkeypatch, links: bool
) -> None:
    """Another backend renders the same frame with other bits meanwhile."""
    others: list[Reference] = []
    exact = type(renderer).render_image

    def brighter(*arguments: object, **named: object) -> torch.Tensor:
        return 1.001 * exact(*arguments, **named)

    def meanwhile(*arguments: object, **named: object) -> torch.Tensor:
        if not others:
            with monkeypatch.context() as patch:
                patch.setattr(type(renderer), "render_image", brighter)
                others.append(ReferenceCache(tmp_path).get(renderer, protocol, V))
        return exact(*arguments, **named)

    def no_links(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    if not links:
        monkeypatch.setattr(os, "link", no_links)
    monkeypatch.setattr(type(renderer), "render_image", meanwhile)
    reference = ReferenceCache(tmp_path).get(renderer, protocol, V)
    (file,) = tmp_path.iterdir()
    cached = read_reference(file, resolution=protocol.resolution)
    assert reference.content_hash == cached.content_hash
    assert (others[0].content_hash == cached.content_hash) == links


def test_pixels_that_are_sometimes_not_finite_are_left_out(
    renderer, protocol, tmp_path, monkeypatch
) -> None:
    exact = type(renderer).render_image

    def sometimes(self, scene_vector, *, seed, **arguments):  # type: ignore[no-untyped-def]
        image = exact(self, scene_vector, seed=seed, **arguments)
        bad = np.random.default_rng(seed).random(image.shape) < 0.05
        image[torch.from_numpy(bad)] = torch.inf
        return image

    monkeypatch.setattr(type(renderer), "render_image", sometimes)
    protocol = dataclasses.replace(protocol, target_noise=1e-6)
    reference = ReferenceCache(tmp_path).get(renderer, protocol, V)
    assert (reference.radiance - renderer.truth(V, 33)).abs().max() < 0.1


def test_pixel_that_never_is_finite_is_an_error(renderer, protocol, tmp_path, monkeypatch) -> None:
    exact = type(renderer).render_image

    def never(self, *arguments, **named):  # type: ignore[no-untyped-def]
        image = exact(self, *arguments, **named)
        image[0, 0, 0] = torch.nan
        return image

    monkeypatch.setattr(type(renderer), "render_image", never)
    with pytest.raises(RuntimeError, match="2 pixels were NaN or Inf in every pass"):
        ReferenceCache(tmp_path).get(renderer, protocol, V)
    assert not list(tmp_path.iterdir())


def test_relative_noise_of_known_halves() -> None:
    a, b = torch.full((2, 2, 3), 1.2), torch.full((2, 2, 3), 0.8)
    assert relative_noise(a, b, 0.0) == pytest.approx(0.2 * (np.pi / 2) ** 0.5, rel=1e-6)
