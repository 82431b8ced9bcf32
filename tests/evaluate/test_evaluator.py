import csv
import dataclasses
import json
import math
from typing import Any

import numpy as np
import pytest
import torch
from PIL import Image

from ngi.evaluate import METRICS, SETS, Evaluator, Reference, ReferenceCache, error_picture, mape
from ngi.evaluate.evaluation import worst_mean


class MeanDistance:
    """Stands where LPIPS does: any function of two pictures."""

    available = True
    reason = None

    def __call__(self, prediction: torch.Tensor, reference: torch.Tensor) -> float:
        return (prediction - reference).abs().mean().item()


class NoLpips:
    available = False
    reason = "no weights here"


@pytest.fixture
def evaluator(renderer, protocol, tmp_path) -> Evaluator:
    cache = ReferenceCache(tmp_path / "references")
    return Evaluator(
        renderer=renderer, test_inputs=v_alone, protocol=protocol, cache=cache, lpips=MeanDistance()
    )


def v_alone(scene_vector: torch.Tensor, buffers: torch.Tensor) -> tuple[torch.Tensor]:  # noqa: ARG001
    return (scene_vector,)


def perfect(buffers: torch.Tensor, scene_vector: torch.Tensor) -> torch.Tensor:
    assert scene_vector.shape == (3,)
    return torch.log1p(buffers)  # the fake renderer's buffers are its noiseless radiance


def test_perfect_prediction_scores_the_floor(evaluator) -> None:
    result = evaluator.evaluate(perfect).result()
    for name in SETS:
        for metric in ("mape", "mae", "lpips"):
            summary = result["metrics"][name][metric]
            assert summary["mean"] == pytest.approx(summary["floor"], rel=0.05)
        dssim = result["metrics"][name]["dssim"]
        assert dssim["floor"] < dssim["mean"] < 3 * dssim["floor"]


def test_relmse_is_that_of_the_truth_whatever_the_references_noise(evaluator, renderer) -> None:
    def brighter(buffers: torch.Tensor, _: torch.Tensor) -> torch.Tensor:
        return torch.log1p(1.2 * buffers)

    result = evaluator.evaluate(brighter).result()
    truths = [renderer.truth(v, evaluator.protocol.resolution) for v in renderer.hard_frames()]
    expected = [((0.2 * r) ** 2 / (r**2 + 0.01)).mean().item() for r in truths]
    found = [frame["relmse"] for frame in result["frames"] if frame["set"] == "hard"]
    assert found == pytest.approx(expected, rel=0.1)
    assert result["relmse"]["hard"] == pytest.approx(np.mean(expected), rel=0.03)
    assert evaluator.evaluate(brighter).row()["hard_relmse"] == result["relmse"]["hard"]
    perfectly = evaluator.evaluate(perfect).result()
    assert abs(perfectly["relmse"]["hard"]) < 0.001 < perfectly["metrics"]["hard"]["mape"]["floor"]


def test_the_tail_is_the_worst_twentieth_of_all_pixels_of_a_set(evaluator) -> None:
    evaluation = evaluator.evaluate(lambda buffers, v: torch.log1p(buffers * (1 + v[0])))
    for name in SETS:
        frames = [each for each in evaluation.frames if each.frame.set == name]
        errors = [
            np.abs(np.log1p(each.prediction.numpy()) - np.log1p(each.reference.radiance.numpy()))
            for each in frames
        ]
        pixels = np.sort(np.stack(errors).mean(axis=-1), axis=None)
        expected = pixels[-math.ceil(0.05 * pixels.size) :].mean()
        assert evaluation.row()[f"{name}_tail"] == pytest.approx(expected, rel=1e-4)
        assert evaluation.result()["tail"][name] == evaluation.row()[f"{name}_tail"]
        assert expected > 1.5 * pixels.mean()


def test_values_are_those_of_the_metrics(evaluator, renderer, protocol, tmp_path) -> None:
    evaluation = evaluator.evaluate(lambda b, v: torch.log1p(b * (1 + v[0])))
    result = evaluation.result()
    cache = ReferenceCache(tmp_path / "references")
    expected = []
    for v in renderer.hard_frames():
        reference = cache.get(renderer, protocol, v)
        truth = renderer.truth(v, protocol.resolution)
        expected.append(mape(truth * (1 + v[0]), reference.radiance, 0.01))
    frames = [frame for frame in result["frames"] if frame["set"] == "hard"]
    assert [frame["mape"] for frame in frames] == pytest.approx(expected, rel=1e-5)
    summary = result["metrics"]["hard"]["mape"]
    assert summary["mean"] == pytest.approx(np.mean(expected), rel=1e-5)
    assert summary["worst5"] == pytest.approx(max(expected), rel=1e-5)
    assert evaluation.row()["hard_mape"] == summary["mean"]
    assert evaluation.row()["hard_mape_worst5"] == summary["worst5"]


def test_worst_mean_is_that_of_whole_frames() -> None:
    assert worst_mean(range(10)) == 9
    assert worst_mean(range(20)) == 19
    assert worst_mean(range(21)) == 19.5
    assert worst_mean(range(60)) == 58
    assert math.isnan(worst_mean([3.0, math.nan, 1.0]))


def test_gradients_are_off_and_references_rendered_once(evaluator, renderer) -> None:
    enabled = []

    def watching(buffers: torch.Tensor, scene_vector: torch.Tensor) -> torch.Tensor:
        enabled.append(torch.is_grad_enabled())
        return perfect(buffers, scene_vector)

    first = evaluator.evaluate(watching)
    assert enabled == [False] * 14
    renderer.seeds.clear()
    assert evaluator.evaluate(perfect).reference_hash == first.reference_hash
    assert not renderer.seeds


def test_evaluators_that_begin_together_share_the_references(renderer, protocol, tmp_path) -> None:
    asked: list[list[tuple[float, ...]]] = []

    class Recording(ReferenceCache):
        def get(self, renderer: Any, protocol: Any, v: torch.Tensor, **more: Any) -> Reference:
            asked[-1].append(tuple(v.tolist()))
            return super().get(renderer, protocol, v, **more)

    for _ in range(2):
        asked.append([])
        evaluator = Evaluator(
            renderer=renderer,
            test_inputs=v_alone,
            protocol=protocol,
            cache=Recording(tmp_path / "references"),
            lpips=MeanDistance(),
        )
        frames = evaluator.evaluate(perfect).frames
        assert [
            f.frame.scene_vector.tolist() for f in frames[:10]
        ] == renderer.hard_frames().tolist()
    first, second = asked
    assert len(set(first)) == 14
    assert sorted(first) == sorted(second)
    assert first != second  # by chance once in 14! times


def test_buffers_come_from_the_present_renderer(evaluator, renderer, protocol, tmp_path) -> None:
    evaluator.prepare()
    evaluator.evaluate(perfect)
    assert renderer.buffer_passes == 14
    other = type(renderer)()
    other.image_buffers = lambda v, *, resolution: torch.full(
        (resolution, resolution, 5), v[0].item()
    )
    cache = ReferenceCache(tmp_path / "references")
    again = Evaluator(
        renderer=other, test_inputs=v_alone, protocol=protocol, cache=cache, lpips=NoLpips()
    )

    def predict(buffers: torch.Tensor, scene_vector: torch.Tensor) -> torch.Tensor:
        assert torch.equal(buffers, scene_vector[0].expand(33, 33, 5))
        return buffers[..., :3]

    assert again.evaluate(predict).reference_hash == evaluator.evaluate(perfect).reference_hash
    assert not other.seeds


def test_result_says_how_good_every_reference_is(evaluator, renderer, protocol, tmp_path) -> None:
    frames = evaluator.evaluate(perfect).result()["frames"]
    assert len(frames) == 14
    cache = ReferenceCache(tmp_path / "references")
    for frame, v in zip(frames, renderer.hard_frames(), strict=False):
        reference = cache.get(renderer, protocol, v)
        assert frame["reference_noise"] == reference.noise <= protocol.target_noise
        assert frame["reference_samples_per_pixel"] == reference.samples_per_pixel


def test_reference_hash_follows_the_references(evaluator, protocol, renderer, tmp_path) -> None:
    first = evaluator.evaluate(perfect).reference_hash

    def hash_with(folder: str, noise: float) -> str:
        renderer.noise = noise
        other = Evaluator(
            renderer=renderer,
            test_inputs=v_alone,
            protocol=protocol,
            cache=ReferenceCache(tmp_path / folder),
            lpips=NoLpips(),
        )
        return other.evaluate(perfect).reference_hash

    assert hash_with("again", 0.5) == first
    assert hash_with("other", 0.4) != first


def test_without_lpips_its_columns_are_empty(renderer, protocol, tmp_path) -> None:
    cache = ReferenceCache(tmp_path)
    evaluator = Evaluator(
        renderer=renderer, test_inputs=v_alone, protocol=protocol, cache=cache, lpips=NoLpips()
    )
    evaluation = evaluator.evaluate(perfect)
    assert evaluation.row()["hard_lpips"] is None
    assert evaluation.row()["uniform_lpips_worst5"] is None
    result = evaluation.result()
    assert result["metrics"]["hard"]["lpips"] is None
    assert result["lpips_note"] == "no weights here"


def test_row_and_result_can_be_written_and_have_fixed_keys(evaluator, tmp_path) -> None:
    row = evaluator.evaluate(perfect).row()
    expected = [
        key
        for name in SETS
        for key in (
            *(f"{name}_{m}{suffix}" for m in METRICS for suffix in ("", "_worst5")),
            *(f"{name}_relmse", f"{name}_tail", f"{name}_non_finite"),
        )
    ]
    assert list(row) == expected
    with (tmp_path / "metrics.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(row))
        writer.writeheader()
        writer.writerow(row)
    json.dumps(evaluator.evaluate(perfect).result(), allow_nan=False)


def test_non_finite_predictions_are_counted_and_make_the_metrics_so(evaluator) -> None:
    def broken(buffers: torch.Tensor, scene_vector: torch.Tensor) -> torch.Tensor:
        answer = torch.log1p(buffers)
        if scene_vector[0] == 0:  # the first hard frame
            answer[2:4, 5] = torch.nan
            answer[0, 0] = 200.0  # expm1 overflows
            answer[1, 1] = -torch.inf  # of which it is -1
        return answer

    evaluation = evaluator.evaluate(broken)
    assert evaluation.result()["non_finite"] == {"hard": 4, "uniform": 0}
    row = evaluation.row()
    assert all(not math.isfinite(row[f"hard_{metric}"]) for metric in METRICS)
    assert all(math.isfinite(row[f"uniform_{metric}"]) for metric in METRICS)


def test_prediction_of_the_wrong_shape_is_refused(evaluator) -> None:
    with pytest.raises(ValueError, match=r"\[33, 33, 1\], expected \[33, 33, 3\]"):
        evaluator.evaluate(lambda b, _: b[..., :1])


def test_every_frame_has_its_pictures(evaluator, tmp_path) -> None:
    evaluator.evaluate(perfect).write_pictures(tmp_path / "pictures")
    files = sorted(file.name for file in (tmp_path / "pictures").iterdir())
    assert len(files) == 14 * 4
    assert "hard_09_prediction.png" in files
    assert "uniform_03.png" in files
    with Image.open(tmp_path / "pictures" / "hard_00_error.png") as picture:
        assert picture.size == (33, 33)
        assert "(reference + 0.01)" in picture.text["scale"]
        assert (picture.text["colour_map"], picture.text["maximum"]) == ("inferno", "0.5")
    with Image.open(tmp_path / "pictures" / "hard_00.png") as sheet:
        assert sheet.width > 3 * 33 * 7
        assert sheet.height > 33 * 7


@pytest.mark.parametrize(("exposure", "shown"), [(0.0, 188), (-1.0, 137)])
def test_pictures_show_the_tone_mapped_radiance(evaluator, tmp_path, exposure, shown) -> None:
    """As sRGB: linear 0.5 and 0.25."""
    evaluation = evaluator.evaluate(lambda b, _: torch.log1p(torch.full_like(b, 0.5)))
    protocol = dataclasses.replace(evaluation.protocol, exposure=exposure)
    dataclasses.replace(evaluation, protocol=protocol).write_pictures(tmp_path)
    with Image.open(tmp_path / "hard_00_prediction.png") as picture:
        assert np.unique(np.asarray(picture)).tolist() == [shown]


def test_error_picture_is_fixed_in_scale_and_marks_what_is_not_finite() -> None:
    reference = torch.full((1, 5, 3), 0.99)
    prediction = torch.tensor([0.99, 1.4899, 5.0, torch.nan, 0.99]).view(1, 5, 1).repeat(1, 1, 3)
    prediction[0, 4] += torch.tensor([-0.25, 0.0, 0.503])  # the mean over the channels is 0.251
    picture = error_picture(prediction, reference, epsilon=0.01)[0].tolist()
    assert picture[0] == [0, 0, 3]  # inferno's ends
    assert picture[1] == picture[2] == [252, 254, 164]
    assert picture[3] == [0, 255, 255]
    assert picture[4] == [187, 55, 84]  # its middle, the 129th of 256 colours


def test_evaluation_is_immutable(evaluator) -> None:
    evaluation = evaluator.evaluate(perfect)
    with pytest.raises(dataclasses.FrozenInstanceError):
        evaluation.reference_hash = "other"


@pytest.mark.parametrize(("target_noise", "said"), [(1e-9, True), (10.0, False)])
def test_references_above_the_noise_level_are_reported_once(
    renderer, protocol, tmp_path, caplog, target_noise, said
) -> None:
    demanding = dataclasses.replace(protocol, target_noise=target_noise)
    cache = ReferenceCache(tmp_path / "references")
    evaluator = Evaluator(
        renderer=renderer, test_inputs=v_alone, protocol=demanding, cache=cache, lpips=NoLpips()
    )
    with caplog.at_level("INFO"):
        evaluator.prepare()
    lines = [r for r in caplog.records if "references still have more than" in r.getMessage()]
    assert len(lines) == int(said)


def test_what_a_frame_takes_is_told_by_part_and_rendered_once(
    renderer, protocol, tmp_path, monkeypatch
) -> None:
    now, asked = [0.0], []
    monkeypatch.setattr("ngi.evaluate.evaluator.perf_counter", lambda: now[0])

    def observations(v: torch.Tensor, buffers: torch.Tensor) -> tuple[torch.Tensor, ...]:
        asked.append((v, buffers))
        now[0] += 2.0
        return v, torch.zeros(3)

    def predict(buffers: torch.Tensor, v: torch.Tensor, zeros: torch.Tensor) -> torch.Tensor:
        assert zeros.shape == (3,)
        now[0] += 0.5
        return perfect(buffers, v)

    evaluator = Evaluator(
        renderer=renderer,
        test_inputs=observations,
        protocol=protocol,
        cache=ReferenceCache(tmp_path),
        lpips=NoLpips(),
    )
    for _ in range(2):
        seconds = evaluator.evaluate(predict).result()["frame_seconds"]
        assert seconds == {"buffers": 0.0, "inputs": 2.0, "network": 0.5}
    assert len(asked) == 10 + protocol.low_discrepancy_frames
    for v, buffers in asked:
        expected = renderer.image_buffers(v, resolution=protocol.resolution)
        assert torch.equal(buffers, expected)
