"""`key=value` command lines of small programs."""

from dataclasses import dataclass

import pytest

from ngi.config.options import option, read_options


@dataclass(frozen=True)
class Many:
    """Its first option is a list."""

    folders: list[str] = option("folders")
    sizes: list[float] | None = option("numbers", None)
    seed: int = option("a number", 0)


@dataclass(frozen=True)
class One:
    """Its first option is one value."""

    folder: str = option("a folder")


@dataclass(frozen=True)
class Nothing:
    """No options."""


RUN = "outputs/machine/mirror/budget.seconds=60,method=ours/seed=0"
"""A run's folder as `ngi train` names it."""


@pytest.mark.parametrize(
    ("words", "folders"),
    [
        (["folders=a"], ["a"]),
        (["folders=[a, b]"], ["a", "b"]),
        (["folders=a", "folders=b"], ["a", "b"]),
        (["folders=[a,b]", "folders=c"], ["a", "b", "c"]),
        ([f"folders={RUN}"], [RUN]),
        ([f"folders={RUN}", "folders=other"], [RUN, "other"]),
        ([RUN, "other"], [RUN, "other"]),
        (["a", "seed=3", "b"], ["a", "b"]),
    ],
)
def test_lists_are_in_brackets_or_item_by_item(words: list[str], folders: list[str]) -> None:
    assert read_options(Many, "ngi many", words).folders == folders


def test_values_become_what_their_options_are() -> None:
    options = read_options(Many, "ngi many", ["a", "sizes=[1,2.5]", "seed=7"])
    assert options == Many(["a"], [1.0, 2.5], 7)
    assert read_options(One, "ngi one", [RUN]) == One(RUN)
    assert read_options(One, "ngi one", ["folder=a", "folder=b"]) == One("b")  # as Hydra has it


@pytest.mark.parametrize(
    ("kind", "words", "message"),
    [
        (Many, [], "give folders=…"),
        (Many, ["a", "sizes=[1,x]"], "'sizes=[1,x]' is wrong"),
        (Many, ["a", "--seed"], "'--seed' is no option; there are folders, seed, sizes"),
        (One, ["a", "b"], "'b' is no option; there are folder"),
        (Nothing, ["a"], "'a' is no option; there are none"),
    ],
)
def test_wrong_words_are_refused_with_what_to_write(
    kind: type, words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        read_options(kind, "ngi it", words)
    assert ended.value.code == 2
    assert f"ngi it: {message}" in capsys.readouterr().err
