"""Mixed precision on a GPU: bfloat16 is chosen where it has units for it, float16 is refused."""

from pathlib import Path

import pytest
import torch

from ngi.machine.precision import fast_precision
from tests.gpu.test_runs import OURS, RUNS, trained
from tests.learn.lightning_warnings import IGNORED

pytestmark = IGNORED


@pytest.mark.usefixtures("gpu")
def test_bfloat16_is_fast_where_a_gpu_has_units_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    assert fast_precision() == "bf16-mixed"
    monkeypatch.setattr(
        torch.cuda, "is_bf16_supported", lambda including_emulation=True: including_emulation
    )
    assert fast_precision() == "32-true"


@pytest.mark.usefixtures("gpu")
@pytest.mark.parametrize("options", [RUNS["paper"], OURS], ids=["paper", "ours"])
def test_a_run_in_bfloat16_multiplies_in_it(
    tmp_path: Path, options: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: set[torch.dtype] = set()
    linear = torch.nn.functional.linear

    def watched(x: torch.Tensor, *rest: torch.Tensor) -> torch.Tensor:
        result = linear(x, *rest)
        seen.add(result.dtype)
        return result

    monkeypatch.setattr(torch.nn.functional, "linear", watched)
    result = trained(tmp_path, *options, "trainer=bf16", "budget.steps=6")
    assert torch.bfloat16 in seen
    assert result["steps_refused"] == 0
    weights = torch.load(tmp_path / "run" / "last.ckpt", weights_only=True)["state_dict"]
    assert {w.dtype for n, w in weights.items() if w.ndim} == {torch.float32}


@pytest.mark.usefixtures("gpu")
def test_float16_is_refused_before_the_first_step(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"trainer.precision: 16-mixed is not supported"):
        trained(tmp_path, *RUNS["paper"], "trainer.precision=16-mixed")
    assert not (tmp_path / "run" / "metrics.csv").exists()
