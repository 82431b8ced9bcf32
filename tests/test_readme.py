"""The README's example of a new sampler works as it stands there."""

import re
from pathlib import Path

from tests.learn.command_line import run

README = Path(__file__).parents[1] / "README.md"


def code_block(first_line: str) -> str:
    blocks = re.findall(r"```\w+\n(.*?)```", README.read_text(), flags=re.DOTALL)
    return next(block for block in blocks if block.startswith(first_line))


def test_a_sampler_is_one_small_file_and_one_yaml(tmp_path: Path) -> None:
    (tmp_path / "my_conf" / "sampler").mkdir(parents=True)
    (tmp_path / "loss_power.py").write_text(code_block("# loss_power.py"))
    yaml = tmp_path / "my_conf" / "sampler" / "loss_power.yaml"
    yaml.write_text(code_block("# my_conf/sampler/loss_power.yaml"))
    status, output = run(
        tmp_path, "sampler=loss_power", "run.folder=run", options=("--config-dir", "my_conf")
    )
    assert status == 0, output
    settings = (tmp_path / "run" / "settings.json").read_text()
    assert "loss_power.LossPower" in settings
