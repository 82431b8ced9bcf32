"""What is recorded as a CUDA graph comes to what is launched kernel by kernel."""

import logging
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import torch
from torch import Tensor, nn

from ngi.learn.graph_trainer import GraphTrainer
from ngi.learn.step_guard import Attempt, StepGuard
from ngi.learn.stream import TrainingStream
from ngi.machine.captured import MOST, Captured
from ngi.view.trained_run import RECORDS, TrainedRun
from tests.gpu.pretended import DEVICE, Ledger
from tests.gpu.test_runs import RUNS, trained
from tests.learn.command_line import SMALL
from tests.learn.comparison import assert_same, assert_same_run, final_state
from tests.learn.lightning_warnings import IGNORED, RESUMED

pytestmark = [*IGNORED, RESUMED]


@pytest.fixture
def network(gpu: Ledger) -> nn.Module:  # noqa: ARG001
    torch.manual_seed(0)
    return nn.Sequential(nn.Linear(3, 4), nn.ReLU(), nn.Linear(4, 2)).to(DEVICE)


def captured(network: nn.Module) -> Captured:
    return Captured(lambda x: (network(x), x.sum()), module=network, name="tests")


def random(*shape: int) -> Tensor:
    return torch.rand(*shape).to(DEVICE)


def assert_as_launched(recorded: Captured, network: nn.Module, x: Tensor) -> None:
    answer, total = recorded(x)
    assert torch.equal(answer.cpu(), network(x).cpu())
    assert total.item() == x.sum().item()


@torch.no_grad()
def test_from_the_third_call_on_a_graph_is_launched(gpu: Ledger, network: nn.Module) -> None:
    recorded = captured(network)
    for number in range(4):
        x = random(5, 3)
        gpu.clear()
        answer, _ = recorded(x)
        assert gpu.launches["graph"] == (number > 0)
        assert (gpu.launches["aten.addmm.default"] == 0) == (number > 1)
        assert gpu.waits.total() == 0
        assert torch.equal(answer.cpu(), network(x).cpu())


@torch.no_grad()
def test_weights_are_read_as_they_are_when_it_is_launched(network: nn.Module) -> None:
    recorded = captured(network)
    for _ in range(4):
        assert_as_launched(recorded, network, random(5, 3))
        for parameter in network.parameters():
            parameter.mul_(-0.5)


@torch.no_grad()
def test_weights_that_have_moved_are_read_where_they_are(network: nn.Module) -> None:
    """As Lightning moves them at the end of training."""
    recorded = captured(network)
    for _ in range(3):
        assert_as_launched(recorded, network, random(5, 3))
    network.to("cpu").to(DEVICE)
    for parameter in network.parameters():
        parameter.add_(1.0)
    for _ in range(3):
        assert_as_launched(recorded, network, random(5, 3))


@torch.no_grad()
def test_every_shape_has_a_graph_of_its_own_but_not_too_many(
    gpu: Ledger, network: nn.Module
) -> None:
    recorded = captured(network)
    for _ in range(3):
        for size in range(1, MOST + 2):
            gpu.clear()
            assert_as_launched(recorded, network, random(size, 3))
    assert gpu.launches["graph"] == 0  # of the last shape, one too many


def test_weights_that_autocast_has_cast_are_cast_anew(network: nn.Module) -> None:
    """Within a longer time of autocast, as Lightning's around a step."""
    recorded = captured(network)
    for _ in range(4):
        with torch.autocast("cuda", torch.bfloat16):
            network(random(2, 3))  # has the weights cast, and kept
            x = random(5, 3)
            answer, _ = recorded(x)
            expected = network(x)
        assert torch.equal(answer.cpu(), expected.cpu())
        with torch.no_grad():
            for parameter in network.parameters():
                parameter.mul_(-2.0)


def test_what_asks_the_device_is_launched_as_it_is_and_said_once(
    network: nn.Module, caplog: pytest.LogCaptureFixture
) -> None:
    recorded = Captured(
        lambda x: (network(x) if x.sum().item() > 0 else x,), module=network, name="asking"
    )
    for _ in range(4):
        x = random(5, 3)
        assert torch.equal(recorded(x)[0].cpu(), network(x).cpu())
    (line,) = (r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING)
    assert line.startswith(
        "asking: not recorded as a CUDA graph, kernels are launched one by one: CUDA"
    )


def test_on_the_cpu_nothing_is_recorded(caplog: pytest.LogCaptureFixture) -> None:
    network = nn.Linear(3, 2)
    recorded = captured(network)
    for _ in range(3):
        assert_as_launched(recorded, network, torch.rand(5, 3))
    assert not caplog.records  # nor tried


LONGER = ("budget.steps=24",)


@pytest.fixture(scope="module")
def launched(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """The folder of a run of these options that is launched kernel by kernel, on the GPU there is.

    Several tests compare with the same one; it is trained once.
    """

    @cache
    def made(*options: str) -> Path:
        folder = tmp_path_factory.mktemp("launched") / "of_a_run"
        trained(folder, *options, "trainer=fast")
        return folder / "run"

    return made


def of_constant_rate(name: str) -> tuple[str, ...]:
    """The options of a run that is longer, and goes on to any length."""
    others = (option for option in RUNS[name] if not option.startswith("schedule"))
    return (*others, "schedule=constant", *LONGER)


@pytest.mark.parametrize("name", ["paper, metropolis", "ours", "ours, exploring", "cnsr"])
def test_a_run_of_graphs_is_the_same_bit_for_bit(
    gpu: Ledger, tmp_path: Path, launched: Callable[..., Path], name: str
) -> None:
    options = (*RUNS[name], *LONGER)
    expected = launched(*options)
    assert gpu.launches["graph"] == 0
    trained(tmp_path / "recorded", *options, "trainer=graphs")
    assert gpu.launches["graph"] > 8
    assert (len(gpu.looks) > 4) == ("ours" in name)
    assert_same_run(expected, tmp_path / "recorded" / "run")


CAMERA = ("renderer._target_=tests.learn.moving_camera.moving_camera",)


@pytest.mark.parametrize(
    ("name", "others"), [("ours", ()), ("ours", CAMERA), ("ours, exploring", ())]
)
def test_in_such_a_run_steps_on_stored_patches_wait_for_nothing(
    gpu: Ledger, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, others: tuple[str, ...]
) -> None:
    """Lightning, logs and batches included."""
    answered: dict[int, int] = {}  # by step, how often the host had waited by then
    feedback_later = TrainingStream.feedback_later

    def noted(stream: TrainingStream, finish: Callable[[], None]) -> None:
        feedback_later(stream, finish)
        answered[stream.counters.iteration] = gpu.waits.total()

    monkeypatch.setattr(TrainingStream, "feedback_later", noted)
    options = (
        *of_constant_rate(name),
        *others,
        "reuse=steady",
        "reuse.policy.probability=0.96",  # enough of them in so few steps
        "evaluation.count=1",
    )  # saved and evaluated at the end only
    trained(tmp_path, *options, "trainer=graphs")
    between = [answered[step + 1] - answered[step] for step in answered if step + 1 in answered]
    assert len(between) > 8
    assert not any(between)


def test_steps_that_are_taken_back_and_again_are_the_same(
    gpu: Ledger,
    tmp_path: Path,
    launched: Callable[..., Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Whatever is the reason: here there is none."""
    options = (*RUNS["ours"], *LONGER)
    at_once = launched(*options)
    asked = []

    def admits(_: StepGuard, attempt: Attempt) -> bool:
        asked.append(attempt.number)
        return attempt.number % 3 > 0

    monkeypatch.setattr(StepGuard, "admits", admits)
    trained(tmp_path / "again", *options, "trainer=graphs", "run.checkpoint_steps=5")
    assert len(asked) > 10
    assert len(gpu.looks) > 4
    assert_same_run(at_once, tmp_path / "again" / "run")


@pytest.mark.usefixtures("gpu")
def test_a_run_whose_steps_are_looked_at_late_goes_on_as_an_unbroken_one(tmp_path: Path) -> None:
    options = of_constant_rate("ours")
    trained(tmp_path / "unbroken", *options, "trainer=fast")
    for steps in (9, 16, 24):
        trained(tmp_path / "longer", *options, "trainer=graphs", f"budget.steps={steps}")
    states = [final_state(tmp_path / name / "run") for name in ("unbroken", "longer")]
    assert_same(*states)


def test_without_a_gpu_it_is_the_same_as_without_graphs(tmp_path: Path) -> None:
    for trainer in ("fast", "graphs"):
        trained(tmp_path / trainer, *SMALL, f"trainer={trainer}")
    assert_same_run(tmp_path / "fast" / "run", tmp_path / "graphs" / "run")


def test_images_of_such_a_run_are_recorded(gpu: Ledger, tmp_path: Path) -> None:
    trained(tmp_path, *SMALL, "trainer=graphs")
    assert f"{GraphTrainer.__module__}.{GraphTrainer.__qualname__}" == RECORDS
    run = TrainedRun.open(tmp_path / "run")
    v = run.renderer.hard_frames()[0]
    images = [run.radiance(v, resolution=24) for _ in range(3)]
    assert gpu.launches["graph"] > 0
    assert torch.equal(images[0], images[2])
