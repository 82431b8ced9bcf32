"""Sobol points and Latin hypercubes, against SciPy's and against what defines them."""

import numpy as np
import pytest
import torch
from scipy import stats
from scipy.stats import qmc
from torch.quasirandom import SobolEngine

from ngi.explore import (
    Always,
    ConstantTarget,
    LatinHypercube,
    MarkovChains,
    Sobol,
    SobolQuarters,
)

CHAINS = (16, 12)


def batches(proposal, *, count, chains=16, dimensions=5, seed=0):
    """The first states of a run's chains, [count, chains, dimensions]."""
    sampler = MarkovChains(
        chains=chains, proposal=proposal, target=ConstantTarget(), acceptance=Always()
    )
    generator = torch.Generator().manual_seed(seed)
    state, found = sampler.init(dimensions), []
    for batch in range(count):
        proposals = sampler.propose(state, generator, batch=batch)
        assert proposals.large_step.all()
        assert proposals.position.dtype == torch.float32
        ids = torch.arange(chains) + batch * chains
        state, _ = sampler.accept(state, proposals, ids, *[torch.ones(chains)] * 2, generator)
        assert torch.equal(state.position, proposals.position)
        found.append(proposals.position)
    return torch.stack(found)


def random_batches(*, count, dimensions=5, seed=0):
    return torch.rand(count, 16, dimensions, generator=torch.Generator().manual_seed(seed))


def leading_bit(integers):
    return np.frexp(integers.astype(np.float64))[1]


@pytest.mark.parametrize("chains", CHAINS)
def test_sobol_points_are_scipys_in_order_but_for_the_scrambling(chains) -> None:
    # Scrambled points, seen from the first, are L x with x the unscrambled ones and L triangular
    # with ones on the diagonal: the leading bit stays.
    points = batches(Sobol(seed=3), count=20, chains=chains, dimensions=30).flatten(0, 1).numpy()
    scrambled = (points.astype(np.float64) * 2**24).astype(np.int64)
    plain = qmc.Sobol(30, scramble=False).random_base2(9)[: len(points)]
    expected = leading_bit((plain * 2**24).astype(np.int64))
    assert np.array_equal(leading_bit(scrambled ^ scrambled[0]), expected)


def test_every_box_of_the_net_holds_one_sobol_point() -> None:
    x, y = batches(Sobol(seed=1), count=16, dimensions=2).flatten(0, 1).double().T
    for bits in range(9):  # boxes of 2^-bits by 2^-(8 - bits)
        box = (x * 2**bits).floor() * 2 ** (8 - bits) + (y * 2 ** (8 - bits)).floor()
        assert box.unique().numel() == 256


@pytest.mark.parametrize("chains", CHAINS)
def test_every_dimension_of_sobol_points_is_stratified(chains) -> None:
    points = batches(Sobol(seed=2), count=43, chains=chains, dimensions=130).flatten(0, 1)[:512]
    for projection in points.T:
        assert (projection.double() * 512).floor().unique().numel() == 512


@pytest.mark.parametrize("chains", CHAINS)
def test_every_dimension_of_a_latin_hypercube_has_one_point_per_interval(chains) -> None:
    for batch in batches(LatinHypercube(), count=20, chains=chains, dimensions=130):
        intervals = (batch.double() * chains + 1e-6).floor().sort(dim=0).values
        assert torch.equal(intervals, torch.arange(chains).double()[:, None].expand(-1, 130))


@pytest.mark.parametrize("dimensions", [2, 7])
def test_both_are_spread_more_evenly_than_uniform_draws_and_like_scipys(dimensions) -> None:
    def discrepancies(draw):
        return [qmc.discrepancy(np.asarray(draw(seed), dtype=np.float64)) for seed in range(100)]

    one = {"count": 1, "dimensions": dimensions}
    uniform = discrepancies(lambda seed: random_batches(**one, seed=seed)[0])
    sobol = discrepancies(lambda seed: batches(Sobol(seed=seed), **one)[0])
    latin = discrepancies(lambda seed: batches(LatinHypercube(), **one, seed=seed)[0])
    scipys_sobol = discrepancies(lambda seed: qmc.Sobol(dimensions, rng=seed).random(16))
    scipys_latin = discrepancies(lambda seed: qmc.LatinHypercube(dimensions, rng=seed).random(16))
    assert np.mean(sobol) < np.mean(latin) < 0.8 * np.mean(uniform)
    assert stats.ttest_ind(sobol, scipys_sobol, equal_var=False).pvalue > 1e-3
    assert stats.ttest_ind(latin, scipys_latin, equal_var=False).pvalue > 1e-3
    assert stats.ttest_ind(latin, uniform, equal_var=False).pvalue < 1e-9


def test_many_batches_together_are_spread_more_evenly_than_uniform_draws() -> None:
    def discrepancy(found):
        return qmc.discrepancy(found.flatten(0, 1).double().numpy())

    uniform = np.mean([discrepancy(random_batches(count=32, seed=seed)) for seed in range(5)])
    assert discrepancy(batches(Sobol(seed=0), count=32)) < 0.1 * uniform
    assert discrepancy(batches(LatinHypercube(), count=32)) < 0.8 * uniform


def test_latin_hypercubes_are_uniform_and_their_variables_independent() -> None:
    points = batches(LatinHypercube(), count=1000, dimensions=3).flatten(0, 1)
    for component in points.T:
        assert stats.kstest(component.numpy(), "uniform").pvalue > 1e-3
        within = (component.double() * 16) % 1
        assert stats.kstest(within.numpy(), "uniform").pvalue > 1e-3
    correlation = torch.corrcoef(points.T)
    assert (correlation - torch.eye(3)).abs().max() < 4 / len(points) ** 0.5


def test_sobol_points_of_all_seeds_are_uniform() -> None:
    first = torch.stack([batches(Sobol(seed=s), count=1, dimensions=3)[0, 0] for s in range(2000)])
    for component in first.T:
        assert stats.kstest(component.numpy(), "uniform").pvalue > 1e-3


def test_a_batch_depends_on_its_number_and_the_seed_alone() -> None:
    expected = batches(Sobol(seed=4), count=8)
    sobol, anywhere = Sobol(seed=4), torch.zeros(16, 5)
    for batch in (5, 2, 2, 7, 0):
        proposals = sobol.propose(anywhere, torch.Generator(), batch=batch)
        assert torch.equal(proposals.position, expected[batch])
    assert sobol.propose(torch.zeros(16, 9), torch.Generator(), batch=0).position.shape == (16, 9)
    assert torch.equal(sobol.propose(anywhere, torch.Generator(), batch=3).position, expected[3])
    assert not torch.equal(batches(Sobol(seed=5), count=1), expected[:1])


def test_no_run_is_trained_on_the_first_test_frame() -> None:
    for seed in range(5):
        frame = SobolEngine(5, scramble=True, seed=seed).draw(1)
        assert torch.equal(frame, SobolEngine(7, scramble=True, seed=seed).draw(1)[:, :5])
        points = batches(Sobol(seed=seed), count=16, dimensions=7)[..., :5]
        assert (points - frame).abs().amax(dim=-1).min() > 1e-3


def test_points_next_to_1_stay_below_it(monkeypatch) -> None:
    nearly = 1 - 2**-30
    monkeypatch.setattr(
        SobolEngine, "draw", lambda *_, dtype: torch.full((16, 2), nearly, dtype=dtype)
    )
    assert (batches(Sobol(seed=0), count=1, dimensions=2) == 1 - 2**-24).all()


@pytest.mark.parametrize("proposal", [Sobol(seed=0), LatinHypercube()])
def test_five_thousand_dimensions(proposal) -> None:
    points = batches(proposal, count=2, dimensions=5002)
    assert ((points >= 0) & (points < 1)).all()
    assert points.unique(dim=-1).shape[-1] == 5002, "no two variables go together"


def test_more_dimensions_than_sobols_sequence_has_are_refused() -> None:
    with pytest.raises(ValueError, match=r"sampler: 21202 dimensions.* at most 21201; .*lat"):
        batches(Sobol(seed=0), count=1, dimensions=21_202)
    batches(LatinHypercube(), count=1, dimensions=21_202)


def test_quarters_are_points_of_the_sequence_at_one_place_in_each_quarter() -> None:
    quarters = batches(SobolQuarters(seed=6), count=8, dimensions=5).unflatten(1, (4, 4))
    points = batches(Sobol(seed=6), count=8, chains=4, dimensions=5)
    assert torch.equal(quarters[:, :, 0], points)
    assert torch.equal(quarters[..., :-2], points[:, :, None, :-2].expand(-1, -1, 4, -1))
    places = quarters[..., -2:].double()
    assert ((places >= 0) & (places < 1)).all()
    quarter = (2 * places).floor()
    assert torch.equal((quarter[..., 0] + 2 * quarter[..., 1]).sort(dim=-1).values, ALL_QUARTERS)
    within = (places % 0.5).sub(places[:, :, :1] % 0.5).abs()
    assert within.max() < 1e-6  # half the range apart, no more and no less


ALL_QUARTERS = torch.arange(4).double().expand(8, 4, 4)


def test_quarters_take_four_patches_of_each_scene_vector() -> None:
    with pytest.raises(ValueError, match=r"sampler\.chains: 6: give a multiple of 4"):
        batches(SobolQuarters(seed=0), count=1, chains=6)
