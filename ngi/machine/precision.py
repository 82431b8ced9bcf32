"""Which precision training is fastest in on this machine."""


def fast_precision() -> str:
    """Lightning's 'bf16-mixed' where the processor or GPU computes in bfloat16, else '32-true'.

    A processor without such units emulates them, many times slower than fp32.
    """
    import torch  # resolved from the configuration, which --help shows without PyTorch

    if torch.cuda.is_available():
        supported = torch.cuda.is_bf16_supported(including_emulation=False)
    else:
        supported = bool(torch.ops.mkldnn._is_mkldnn_bf16_supported())
    return "bf16-mixed" if supported else "32-true"
