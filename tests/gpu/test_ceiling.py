"""The study of what a choice of patches could gain, on a pretended GPU."""

from pathlib import Path

import pandas as pd
import pytest

from ngi.studies.ceiling import campaign
from tests.gpu.machine import pretended_gpu
from tests.studies.test_ceiling import configuration


@pytest.mark.usefixtures("muon_rounds_alike")
def test_a_study_on_the_gpu_comes_to_what_one_on_the_cpu_comes_to(tmp_path: Path) -> None:
    on_cpu = pd.read_csv(campaign.run_all(configuration(tmp_path / "cpu")))
    with pretended_gpu() as ledger:
        on_gpu = pd.read_csv(campaign.run_all(configuration(tmp_path / "gpu", "trainer=graphs")))
    assert ledger.launches.total() > 1000
    assert ledger.launches["graph"] > 0
    pd.testing.assert_frame_equal(on_cpu, on_gpu, rtol=1e-2)
