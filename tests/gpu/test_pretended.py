"""The pretended GPU is as strict as a real one, and gives the CPU's numbers."""

import copy
import io

import pytest
import torch

from tests.gpu.pretended import Ledger, OnGpu


@pytest.mark.usefixtures("gpu")
def test_numbers_are_those_of_the_cpu() -> None:
    torch.manual_seed(0)
    network = torch.nn.Sequential(torch.nn.Linear(3, 5), torch.nn.ReLU(), torch.nn.Linear(5, 2))
    other = copy.deepcopy(network).to("cuda")
    x = torch.randn(4, 3)
    assert all(isinstance(p, OnGpu) and p.is_cuda for p in other.parameters())
    for model, inputs in ((network, x), (other, x.to("cuda"))):
        optimizer = torch.optim.Adam(model.parameters())
        for _ in range(3):
            optimizer.zero_grad()
            model(inputs).square().sum().backward()
            optimizer.step()
    for a, b in zip(network.parameters(), other.parameters(), strict=True):
        assert b.device.type == "cuda"
        assert torch.equal(a, b.cpu())


@pytest.mark.usefixtures("gpu")
def test_what_is_on_two_devices_does_not_meet() -> None:
    here, there = torch.ones(3), torch.ones(3, device="cuda")
    for meet in (
        lambda: here + there,
        lambda: torch.where(there > 0, there, here),
        lambda: torch.stack([here, there]),
        lambda: here.add_(there[0]),
        lambda: here[there.long()],
    ):
        with pytest.raises(RuntimeError, match=r"same device|was to write"):
            meet()
    assert (there + torch.tensor(1.0)).sum().item() == 6  # a number is of any device
    with pytest.raises(TypeError, match="can't convert cuda:0"):
        there.numpy()


def test_the_host_waits_where_it_asks_for_numbers(gpu: Ledger) -> None:
    x = torch.arange(4.0, device="cuda")
    gpu.clear()
    (x * 2).sum()
    assert gpu.waits.total() == 0
    asked = (lambda: x.sum().item(), lambda: bool(x.sum() > 1), lambda: float(x[0]), x.cpu,
             x.tolist, lambda: x[x > 1], x.nonzero, torch.cuda.synchronize)  # fmt: skip
    for ask in asked:
        gpu.clear()
        ask()
        assert gpu.waits.total() == 1
    for upload, waits in (
        (lambda x: x.to("cuda"), 1),
        (lambda x: x.to("cuda", non_blocking=True), 1),  # the system may move its memory
        (lambda x: x.pin_memory().to("cuda", non_blocking=True), 0),
        (lambda x: torch.zeros(3, device="cuda").copy_(x.pin_memory(), non_blocking=True), 0),
        (lambda x: torch.tensor(x.tolist(), device="cuda"), 1),
    ):
        gpu.clear()
        upload(torch.ones(3))
        assert (gpu.waits.total(), gpu.uploads.total()) == (waits, 1)


@pytest.mark.usefixtures("gpu")
def test_a_file_is_read_to_the_cpu_and_loaded_onto_the_gpu() -> None:
    network = torch.nn.Linear(3, 2).to("cuda")
    file = io.BytesIO()
    torch.save(network.state_dict(), file)
    file.seek(0)
    state = torch.load(file, weights_only=True)
    assert not any(isinstance(value, OnGpu) for value in state.values())
    fresh = torch.nn.Linear(3, 2).to("cuda")
    fresh.load_state_dict(state)
    assert torch.equal(fresh.weight, network.weight)
