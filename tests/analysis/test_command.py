"""Commands end with a line, not with a traceback, where what they were given cannot be used."""

import pytest

from analysis.command import errors_in_a_line


@pytest.mark.parametrize("error", [ValueError("no runs below x"), FileNotFoundError("x: no file")])
def test_what_was_given_is_answered_in_a_line(
    error: Exception, capsys: pytest.CaptureFixture[str]
) -> None:
    @errors_in_a_line
    def main() -> int:
        raise error

    assert main() == 1
    said = capsys.readouterr()
    assert said.err == f"error: {error}\n"
    assert said.out == ""


@pytest.mark.parametrize("error", [BrokenPipeError, KeyError])
def test_everything_else_is_raised(error: type[BaseException]) -> None:
    @errors_in_a_line
    def main() -> int:
        raise error

    with pytest.raises(error):
        main()


def test_ctrl_c_is_answered_by_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    @errors_in_a_line
    def main() -> int:
        raise KeyboardInterrupt

    assert main() == 130
    assert capsys.readouterr() == ("", "")


def test_arguments_and_status_are_those_of_the_command() -> None:
    @errors_in_a_line
    def main(argv: list[str], *, status: int) -> int:
        """What it does."""
        return status + len(argv)

    assert main(["a"], status=2) == 3
    assert main.__doc__ == "What it does."
