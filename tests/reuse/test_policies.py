import io
from itertools import pairwise

import pytest
import torch
from scipy.special import expit

from ngi.reuse import FixedProbability, Never, PolicyState, ReusePolicy, SelfTuning, UntilFull

PAPER = {"bootstrap_batches": 100, "beta": 4.6, "ema_coefficient": 0.9}
LATER = {"generated_batches": 100, "store_size": 1600, "store_capacity": 100_000}


def update(policy, state, reused, losses, large_step=None):
    losses = torch.tensor(losses)
    if large_step is None:
        large_step = torch.ones(len(losses), dtype=torch.bool)
    return policy.update(
        state, reused=reused, losses=losses, large_step=torch.as_tensor(large_step)
    )


def test_equal_losses_give_the_paper_s_probability() -> None:
    state = PolicyState(existing_loss=0.3, new_loss=0.3)
    assert SelfTuning(**PAPER).probability(state, **LATER) == pytest.approx(0.99, abs=1e-4)


@pytest.mark.parametrize("beta", [-2000.0, -5.0, 0.0, 2.0, 4.6, 2000.0])
@pytest.mark.parametrize(("existing", "new"), [(0.0, 0.0), (0.1, 0.9), (0.9, 0.1), (0.0, 1e4)])
def test_probability_is_the_sigmoid_of_the_difference(beta, existing, new) -> None:
    policy = SelfTuning(bootstrap_batches=0, beta=beta, ema_coefficient=0.9)
    state = PolicyState(existing_loss=existing, new_loss=new)
    expected = float(expit(existing - new + beta))
    assert policy.probability(state, **LATER) == pytest.approx(expected, rel=1e-12, abs=1e-300)


def test_averages_start_at_the_loss_at_the_end_of_the_bootstrap() -> None:
    policy = SelfTuning(**PAPER | {"bootstrap_batches": 3})
    state = policy.init()
    for loss in (9.0, 5.0, 2.0):
        state = update(policy, state, False, [loss])
    assert (state.existing_loss, state.new_loss) == (2.0, 2.0)
    state = update(policy, state, False, [1.0])
    assert (state.existing_loss, state.new_loss) == (2.0, pytest.approx(1.9))
    state = update(policy, state, True, [3.0])
    assert (state.existing_loss, state.new_loss) == (pytest.approx(2.1), pytest.approx(1.9))
    assert state.generated_batches == 4


@pytest.mark.parametrize("reused", [False, True])
def test_averages_follow_the_closed_form(reused) -> None:
    policy = SelfTuning(**PAPER | {"bootstrap_batches": 1})
    state = update(policy, policy.init(), False, [4.0])
    losses = [0.5, 3.0, 1.0, 0.0, 7.0]
    for loss in losses:
        state = update(policy, state, reused, [loss - 0.25, loss + 0.25])
    # c^n x_0 + (1 - c) sum_i c^(n - i) x_i
    expected = 0.9**5 * 4 + 0.1 * sum(0.9 ** (4 - i) * x for i, x in enumerate(losses))
    moved, kept = state.new_loss, state.existing_loss
    if reused:
        moved, kept = kept, moved
    assert moved == pytest.approx(expected)
    assert kept == 4


def test_only_finite_losses_of_large_steps_count() -> None:
    policy = SelfTuning(**PAPER | {"bootstrap_batches": 1})
    state = update(policy, policy.init(), False, [4.0])
    nan, inf = float("nan"), float("inf")
    mixed = update(policy, state, True, [1.0, 8.0, nan, inf, 3.0], [True, False, True, True, True])
    assert mixed.existing_loss == pytest.approx(0.9 * 4 + 0.1 * 2)
    for losses, large in [([8.0, 9.0], [False, False]), ([nan, 9.0], [True, False]), ([], [])]:
        large = torch.tensor(large, dtype=torch.bool)
        assert update(policy, state, True, losses, large) == state


@pytest.mark.parametrize(
    "policy", [SelfTuning(**PAPER), FixedProbability(bootstrap_batches=100, probability=0.7)]
)
def test_the_bootstrap_generates_only(policy) -> None:
    state = PolicyState(existing_loss=0.3, new_loss=0.3)
    probability = [
        policy.probability(state, generated_batches=n, store_size=16 * n, store_capacity=10**5)
        for n in (0, 1, 99, 100, 101)
    ]
    assert probability[:3] == [0, 0, 0]
    assert probability[3] == probability[4] >= 0.7


def test_a_bootstrap_without_a_finite_loss_goes_on() -> None:
    policy = SelfTuning(**PAPER | {"bootstrap_batches": 1})
    state = update(policy, policy.init(), False, [float("nan")])
    assert policy.probability(state, **LATER) == 0
    state = update(policy, state, False, [2.0])
    assert (state.existing_loss, state.new_loss) == (2.0, 2.0)
    assert policy.probability(state, **LATER) > 0.98


@pytest.mark.parametrize(
    ("policy", "expected"),
    [
        (Never(), [0, 0, 0]),
        (UntilFull(), [0, 0, 1]),
        (FixedProbability(bootstrap_batches=0, probability=0.25), [0, 0.25, 0.25]),
        (SelfTuning(bootstrap_batches=0, beta=0, ema_coefficient=0.9), [0, 0.5, 0.5]),
    ],
    ids=lambda part: type(part).__name__,
)
def test_every_policy_keeps_the_protocol(policy, expected) -> None:
    state = policy.init()
    assert policy.probability(state, generated_batches=0, store_size=0, store_capacity=64) == 0
    state = update(policy, state, False, [1.0])
    state = update(policy, state, True, [1.0])
    assert state.generated_batches == 1
    sizes = [
        policy.probability(state, generated_batches=4, store_size=size, store_capacity=64)
        for size in (0, 63, 64)
    ]
    assert sizes == expected

    file = io.BytesIO()
    torch.save(state.state_dict(), file)
    file.seek(0)
    assert PolicyState.from_state_dict(torch.load(file, weights_only=True)) == state


@pytest.mark.parametrize(
    ("samples", "times"),
    [(1, 10.0), (32, 10.0), (128, 20.0), (288, 30.0), (512, 40.0), (24000, 40.0)],
)
def test_a_patch_is_trained_on_as_often_as_its_noise_is_low(samples: int, times: float) -> None:
    """Of so many steps one is on new patches, which all the others then share."""
    policy = FixedProbability.by_samples(
        bootstrap_batches=0, times_at_32=10.0, samples_per_pixel=samples
    )
    new = 1 - policy.probability(policy.init(), **LATER)
    assert new == pytest.approx(1 / times)


@pytest.mark.parametrize("probability", [0.0, 0.5, 0.92, 0.98, 1.0])
@pytest.mark.parametrize("bootstrap", [1, 3])
def test_a_fixed_share_is_generated_at_even_distances(probability: float, bootstrap: int) -> None:
    """By counting, whatever is drawn."""
    policy = FixedProbability(bootstrap_batches=bootstrap, probability=probability)
    when = []
    for batch in range(1000):
        p = policy.probability(
            policy.init(), generated_batches=len(when), store_size=batch, store_capacity=10**5
        )
        draw = (batch * 0.618) % 1
        if not policy.reuses(p, draw=draw, batches=batch, generated_batches=len(when)):
            when.append(batch)
        since = batch + 1 - bootstrap
        assert since <= 0 or abs(len(when) - bootstrap - since * (1 - probability)) <= 0.51
    assert when[:bootstrap] == list(range(bootstrap))
    distances = {b - a for a, b in pairwise(when[bootstrap:])}
    assert len(distances) <= 2
    assert all(abs(distance * (1 - probability) - 1) < 1 - probability for distance in distances)


def test_batches_that_were_postponed_are_made_up_for() -> None:
    policy = FixedProbability(bootstrap_batches=3, probability=0.9)
    late = {"draw": 0.5, "batches": 3 + 25}
    assert [policy.reuses(0.9, generated_batches=n, **late) for n in (4, 5, 6)] == [0, 0, 1]


@pytest.mark.parametrize("policy", [SelfTuning(**PAPER), UntilFull(), Never()])
def test_the_papers_policy_and_the_fixed_data_set_draw(policy: ReusePolicy) -> None:
    """As they always did: a number below the probability reuses."""
    counts = {"batches": 50, "generated_batches": 7}
    assert policy.reuses(0.7, draw=0.699, **counts)
    assert not policy.reuses(0.7, draw=0.7, **counts)
    assert not policy.reuses(0.0, draw=0.0, **counts)


def test_at_32_samples_ours_reuses_as_often_as_when_its_figures_were_measured() -> None:
    policy = FixedProbability.by_samples(
        bootstrap_batches=0, times_at_32=12.5, samples_per_pixel=32
    )
    assert policy.probability(policy.init(), **LATER) == 0.92


def test_where_the_last_steps_bring_nothing_new_the_others_bring_as_much_more() -> None:
    policy = FixedProbability.by_samples(
        bootstrap_batches=0, times_at_32=12.5, samples_per_pixel=32, stored_alone=0.2
    )
    assert policy.stored_alone == 0.2
    new = 1 - policy.probability(policy.init(), **LATER)
    assert new * (1 - 0.2) == pytest.approx(1 / 12.5)


@pytest.mark.parametrize("share", [-0.1, 1.0, float("nan")])
def test_the_last_share_of_the_steps_is_in_range(share: float) -> None:
    with pytest.raises(ValueError, match=rf"stored_alone: {share}: give a number in \[0, 1\)"):
        FixedProbability.by_samples(
            bootstrap_batches=0, times_at_32=12.5, samples_per_pixel=32, stored_alone=share
        )


def test_patches_that_are_to_be_trained_on_less_than_once_are_not_reused() -> None:
    policy = FixedProbability.by_samples(bootstrap_batches=0, times_at_32=0.5, samples_per_pixel=32)
    assert policy.probability(policy.init(), **LATER) == 0


@pytest.mark.parametrize("times", [0.0, -1.0, float("nan"), float("inf")])
def test_how_often_is_a_number_above_0(times: float) -> None:
    with pytest.raises(ValueError, match=f"times_at_32: {times}: give"):
        FixedProbability.by_samples(bootstrap_batches=0, times_at_32=times, samples_per_pixel=32)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("bootstrap_batches", -1),
        ("beta", float("nan")),
        ("ema_coefficient", 1.0),
        ("ema_coefficient", -0.1),
    ],
)
def test_self_tuning_rejects_bad_constants(key, value) -> None:
    with pytest.raises(ValueError, match=f"{key}: {value}"):
        SelfTuning(**PAPER | {key: value})


def test_other_bad_input_is_named() -> None:
    with pytest.raises(ValueError, match=r"probability: 1\.5"):
        FixedProbability(bootstrap_batches=0, probability=1.5)
    with pytest.raises(ValueError, match="bootstrap_batches: -1"):
        FixedProbability(bootstrap_batches=-1, probability=0.5)
    with pytest.raises(ValueError, match="large_step: shape"):
        update(SelfTuning(**PAPER), PolicyState(), True, [1.0, 2.0], [True])
