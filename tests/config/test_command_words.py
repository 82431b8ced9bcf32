"""What the words of a command line become before Hydra reads them."""

from pathlib import Path

import pytest

from ngi.config.command_words import completed, in_order, with_overrides
from tests.learn.command_line import run


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("scene=mirror", "budget=machine method=ours scene=mirror"),
        ("scene=x budget.seconds=60", "budget=machine method=ours scene=x budget.seconds=60"),
        ("--cfg job", "--cfg job budget=machine method=ours"),
        ("-m sampler=uniform,sobol", "-m budget=machine method=ours sampler=uniform,sobol"),
        ("budget=machine", "method=ours budget=machine"),
        ("method=ours_eager", "budget=machine method=ours_eager"),
        ("-m method=ours,ours_without/muon", "-m budget=machine method=ours,ours_without/muon"),
        (
            "-m method=choice(ours,ours_eager)",
            "-m budget=machine method=choice(ours,ours_eager)",
        ),
        (
            "-m method=ours,active_exploration",
            "-m budget=machine method=ours,active_exploration",
        ),
        ("-m method=choice(uniform,ours)", "-m budget=machine method=choice(uniform,ours)"),
        ("-m method=glob(ours_*)", "-m budget=machine method=glob(ours_*)"),
        ("-m method=glob([u*,ours])", "-m budget=machine method=glob([u*,ours])"),
        ("-m method=shuffle(uniform,ours)", "-m budget=machine method=shuffle(uniform,ours)"),
        ("-m method=sort(uniform,ours)", "-m budget=machine method=sort(uniform,ours)"),
        ("method='ours_eager'", "budget=machine method='ours_eager'"),
        ("-m method=uniform,'ours'", "-m budget=machine method=uniform,'ours'"),
        ("budget=machine method=uniform", "budget=machine method=uniform"),
        ("scene=x budget=hour", "method=ours_small_patches scene=x budget=hour"),
        ("budget=scarce seed=1", "method=ours_small_patches budget=scarce seed=1"),
        ("budget=scarce method=ours", "budget=scarce method=ours"),
        ("-m budget=hour,scarce", "-m method=ours_small_patches budget=hour,scarce"),
        ("budget='hour'", "method=ours_small_patches budget='hour'"),
        ("-m budget=machine,hour method=ours", "-m budget=machine,hour method=ours"),
    ],
)
def test_ours_is_trained_where_the_words_leave_it_open(words: str, expected: str) -> None:
    assert completed(words.split()) == expected.split()


@pytest.mark.parametrize(
    "words",
    [
        "budget=paper",
        "budget=small scene=mirror",
        "budget=seconds budget.seconds=60",
        "method=active_exploration",
        "-m method=uniform,active_exploration",
        "method=oursome",
        "-m method=glob(u*)",
        "-m method=glob(*,exclude=ours*)",
        "-m method=shuffle(uniform,cnsr)",
        "method=ours(",
        "method=ours_eager budget=small",
        "method=active_exploration budget=scarce",
        "-m +sweeps=ours_hour budget=hour",
        "-m budget=small,hour",
        "experiment=demo",
        "-m +sweeps=same_time",
        "+path_tracing=oidn",
        "++method=uniform",
        "-m budget=small,paper",
    ],
)
def test_what_is_named_is_taken_at_its_word(words: str) -> None:
    assert completed(words.split()) == words.split()


def test_budgets_that_train_different_methods_ask_for_one() -> None:
    with pytest.raises(SystemExit, match=r"^budget=machine,hour: name .* ours for"):
        completed(["-m", "budget=machine,hour"])


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("", "x=1"),
        ("--help", "--help x=1"),
        ("a=b c=d", "x=1 a=b c=d"),
        ("-m +sweeps=s budget=small", "-m x=1 +sweeps=s budget=small"),
        ("--config-dir conf a=b -m", "--config-dir conf x=1 a=b -m"),
        ("--config-dir=conf a=b", "--config-dir=conf x=1 a=b"),
    ],
)
def test_further_overrides_stand_with_the_users(words: str, expected: str) -> None:
    assert with_overrides(words.split(), "x=1") == expected.split()


def test_an_option_may_stand_among_overrides() -> None:
    words = ["scene=mirror", "-m", "seed=0,1"]
    assert in_order(words) == ["-m", "scene=mirror", "seed=0,1"]
    assert in_order(words[::2]) == words[::2]


@pytest.mark.parametrize(
    ("folder", "word"),
    [
        ("outputs/method=x,seed=0", "'outputs/method=x,seed=0'"),
        ("'outputs/seed=0'", "'outputs/seed=0'"),
        ('"outputs/seed=0"', '"outputs/seed=0"'),
        ("outputs/a,outputs/b", "outputs/a,outputs/b"),  # a sweep's
        ("outputs/${seed}", "outputs/${seed}"),
        ("", ""),
    ],
)
def test_a_folder_that_hydra_would_refuse_is_quoted(folder: str, word: str) -> None:
    assert in_order([f"run.folder={folder}", "a=b=c"]) == [f"run.folder={word}", "a=b=c"]


def test_a_folder_may_be_named_as_runs_name_it(tmp_path: Path) -> None:
    status, output = run(tmp_path, "run.folder=outputs/method=x,y/seed=0")
    assert status == 0, output
    assert (tmp_path / "outputs/method=x,y/seed=0/result.json").is_file()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["a=b", "--budget", "small"], "--budget: there is no such option; .*: budget=…"),
        (["--seed=1"], "--seed=1: there is no such option; .* without dashes: seed=1 "),
        (["a=b", "--cfg", "job", "c=d"], "^c=d: put options, such as -m, before all words"),
        (["+sweeps=demo", "a=b"], "^.sweeps=demo: a sweep needs -m"),
        (["--dry-run", "+sweeps=demo"], "^.sweeps=demo: a sweep needs -m"),
    ],
)
def test_what_is_no_option_is_answered_by_what_it_may_be(words: list[str], message: str) -> None:
    with pytest.raises(SystemExit, match=message):
        in_order(words)


def test_all_settings_of_a_run_can_be_shown(tmp_path: Path) -> None:
    """As the help says; the folder's name is by choices that Hydra takes away before it shows."""
    options = ("--cfg", "job", "--resolve")
    status, output = run(tmp_path, "scene=mirror", "+sweeps=dear", base=(), options=options)
    assert status == 0, output
    assert f"folder: {tmp_path}/outputs/dear/paper/mirror/default/seed=0\n" in output


TINY = (
    "renderer=analytic",
    "~renderer.direct",
    "~renderer.specular",
    "evaluation=smoke",
    "model.hidden_features=16",
    "budget.seconds=2",
)


def test_a_bare_command_trains_ours_and_says_what_that_is(tmp_path: Path) -> None:
    status, output = run(tmp_path, *TINY, base=())
    assert status == 0, output
    assert "ours; 2 s on" in output
    assert "encoded_generator of 6 x 16 features; 8 patches of 32 x 32 pixels a step" in output
    assert "1 new batches before the first is reused" in output
    assert len(list(tmp_path.glob("outputs/machine/*/*/seed=0/result.json"))) == 1


def test_a_run_that_ends_within_its_bootstrap_says_so(tmp_path: Path) -> None:
    status, output = run(tmp_path, "reuse.policy.bootstrap_batches=20", "budget.steps=3")
    assert status == 0, output
    assert "each of the 3 steps waited for new patches" in output
    assert "reuse.policy.bootstrap_batches=20" in output
