"""Bfloat16 where a processor has units for it, float32 elsewhere."""

import pytest
import torch

from ngi.machine.precision import fast_precision, multiplies_bfloat16, shown_in


@pytest.mark.parametrize(
    ("units", "expected"),
    [
        ({"architecture": "x86_64", "avx512_bw": True}, False),  # as Ice Lake: oneDNN emulates it
        ({"architecture": "x86_64", "avx512_bf16": True, "amx_bf16": False}, True),
        ({"architecture": "x86_64", "avx512_bf16": False, "amx_bf16": True}, True),
        ({"architecture": "aarch64"}, True),
    ],
)
def test_a_processor_that_only_takes_bfloat16_does_not_multiply_in_it(
    units: dict[str, object], expected: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(torch.ops.mkldnn, "_is_mkldnn_bf16_supported", lambda: True)
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: units)
    assert multiplies_bfloat16("cpu") == expected
    assert fast_precision() == ("bf16-mixed" if expected else "32-true")
    assert shown_in("bf16-mixed", "cpu") == (torch.bfloat16 if expected else torch.float32)
    assert shown_in("32-true", "cpu") == torch.float32
    monkeypatch.setattr(torch.ops.mkldnn, "_is_mkldnn_bf16_supported", lambda: False)
    assert not multiplies_bfloat16("cpu")
