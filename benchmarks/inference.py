"""Goal posterior and decision against general engines (pyAgrum, pgmpy), batches, and growth.

All engines hold the same model, p(G) p(X_i) p(A | G, X_i) p(X_f | X_i, A), get the same queries in
turn in the same process, and must give the same answers. Needs inference_peers.lock, which
bench.sh installs. `--calls N` (2000): calls of ours and pyAgrum; pgmpy gets a tenth.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from inference_peers import Agrum, Engine, Pgmpy
from likeme_core.progress_bar import counted
from likeme_core.tabletop import Mode
from likeme_inference.tabletop.action_selection import choose
from likeme_inference.tabletop.asking import choose_least_cost
from likeme_inference.tabletop.cost_planning import Costs
from likeme_inference.tabletop.dirichlet import CONCENTRATION
from likeme_inference.tabletop.goal_inference import goal_posterior
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.sparse import SparseGoalModel
from likeme_inference.tabletop.transition_model import TransitionModel
from report import Bar, option_parser, publish, whole_number

Change = tuple[int, int]
#: The changes of the paper: LEFT to RIGHT, LEFT to OFFTABLE, RIGHT to LEFT, RIGHT to OFFTABLE.
CHANGES: tuple[Change, ...] = ((0, 1), (0, 2), (1, 0), (1, 2))
BATCH = 1_000_000
COSTS = Costs()
#: Calls between two updates of the bar.
BLOCK = 100
SIZES = ((3, 6), (10, 10), (30, 20), (100, 30), (300, 40), (1000, 50))
#: Beyond this many states a general engine's table P(A | G, X_i) alone has over 10^7 entries.
PEER_STATES = 30


class Ours:
    """GoalModel, called as by the node."""

    def __init__(self, model: GoalModel) -> None:
        self._model = model

    def goal_posterior(self, x_i: int, x_f: int) -> Any:
        """P(G | x_i, x_f)."""
        return self._model.goal_posterior(x_i, x_f)

    def decision(self, x_i: int, x_f: int) -> tuple[int, int, float]:
        """MAP goal, MAP action, predicted success; whether to ask by it, which is not returned."""
        goal = int(self.goal_posterior(x_i, x_f).argmax())
        made = choose(self._model, x_i, goal, None, Mode.INTERACTIVE, 0.5)
        assert made.action is not None, 'Each of these goals can be reached.'
        return goal, made.action, made.predicted_success


class ByCost(Ours):
    """Asks by what it costs."""

    def decision(self, x_i: int, x_f: int) -> tuple[int, int, float]:
        """Goal, action and predicted success of the least expected cost."""
        posterior = self.goal_posterior(x_i, x_f)
        goal, made, _ = choose_least_cost(
            self._model, x_i, int(posterior.argmax()), posterior, Mode.INTERACTIVE, COSTS
        )
        assert made.action is not None, 'Each of these goals can be reached.'
        return goal, made.action, made.predicted_success


class Uncached(Ours):
    """Each query computed without the answers that a GoalModel keeps."""

    def goal_posterior(self, x_i: int, x_f: int) -> Any:
        """P(G | x_i, x_f)."""
        known = self._model
        return goal_posterior(known.transition, known.policy, x_i, x_f, known.prior)

    def decision(self, x_i: int, x_f: int) -> tuple[int, int, float]:
        """See Ours."""
        self._model.answers.clear()
        return super().decision(x_i, x_f)


class Times(NamedTuple):
    """Percentiles of single calls, s, and their number."""

    p50: float
    p99: float
    n: int


def timed(
    calls: Sequence[Callable[[int, int], Any]], numbers: Sequence[int], what: str = ''
) -> list[Times]:
    """Time several functions in turn, so that all run under the same load.

    what: shown with the progress, if it can last.
    """
    spent: list[list[int]] = [[] for _ in calls]
    blocks = range(0, max(numbers), BLOCK)
    shown = f'{what}, {BLOCK} calls each'
    for first in counted(blocks, shown, len(blocks), timed=True) if what else blocks:
        for k in range(first, min(first + BLOCK, max(numbers))):
            x_i, x_f = CHANGES[k % len(CHANGES)]
            for call, times, number in zip(calls, spent, numbers, strict=True):
                if k < number:
                    begin = time.perf_counter_ns()
                    call(x_i, x_f)
                    times.append(time.perf_counter_ns() - begin)
    return [
        Times(
            float(np.percentile(times, 50)) * 1e-9,
            float(np.percentile(times, 99)) * 1e-9,
            len(times),
        )
        for times in spent
    ]


def check_same(ours: Ours, peers: Sequence[Engine]) -> None:
    """Fail unless all engines give the same answers."""
    for peer in peers:
        for change in CHANGES:
            assert np.allclose(
                ours.goal_posterior(*change), peer.goal_posterior(*change), atol=1e-9
            )
            assert ours.decision(*change)[:2] == peer.decision(*change)[:2]
            assert abs(ours.decision(*change)[2] - peer.decision(*change)[2]) < 1e-9


def single(calls: int) -> list[Bar]:
    """Single queries: p50, p99, and the ratio to the peers."""
    model, other = (
        GoalModel.of(TransitionModel(shipped().objects['pear'].counts, CONCENTRATION).transition)
        for _ in range(2)
    )
    ours, anew, agrum, pgmpy = Ours(model), Uncached(other), Agrum(model), Pgmpy(model)
    check_same(ours, (anew, agrum, pgmpy))
    bars = []
    for what, mine, limits in [
        ('goal_posterior', {'ours': ours, 'ours, anew': anew}, {'pyAgrum': 15.0, 'pgmpy': 20.0}),
        (
            'decision',
            {'ours': ours, 'ours, by cost': ByCost(model), 'ours, anew': anew},
            {'pyAgrum': 20.0},
        ),
    ]:
        engines: dict[str, Engine] = {**mine, 'pyAgrum': agrum, 'pgmpy': pgmpy}
        methods = [getattr(engine, what) for engine in engines.values()]
        numbers = [calls // 10 if name == 'pgmpy' else calls for name in engines]
        times = dict(zip(engines, timed(methods, numbers, what), strict=True))
        for name, t in times.items():
            bars += [
                Bar(f'{what} {name} p50', t.p50 * 1e6, None, 'us', n=t.n),
                Bar(f'{what} {name} p99', t.p99 * 1e6, None, 'us', n=t.n),
            ]
        for name, peer in product(mine, ('pyAgrum', 'pgmpy')):
            t, bar = times[peer], limits.get(peer) if 'anew' not in name else None
            ratio = t.p50 / times[name].p50
            bars.append(Bar(f'{what} {name}: times faster', ratio, bar, 'x', peer, t.n, False))
    cold = timed([first_answer(Ours), first_answer(Agrum), first_answer(Pgmpy)], (40, 40, 40))
    for name, t in zip(('ours', 'pyAgrum', 'pgmpy'), cold, strict=True):
        bars.append(
            Bar(f'new model to first posterior {name} p50', t.p50 * 1e6, None, 'us', n=t.n)
        )
    return bars


def first_answer(engine: Callable[[GoalModel], Engine]) -> Callable[[int, int], Any]:
    """Everything from the counts to the first posterior, as after each new trial."""
    counts = shipped().objects['pear'].counts

    def answer(x_i: int, x_f: int) -> Any:
        model = GoalModel.of(TransitionModel(counts, CONCENTRATION).transition)
        return engine(model).goal_posterior(x_i, x_f)

    return answer


def batches() -> list[Bar]:
    """10^6 demonstrations in one call, certain and uncertain; processor time of one core."""
    model, rng = shipped().goal_model('pear'), np.random.default_rng(0)
    x_i, x_f = rng.integers(0, 2, BATCH), rng.integers(0, 3, BATCH)
    soft_i, soft_f = rng.dirichlet([1, 1, 1], BATCH), rng.dirichlet([1, 1, 1], BATCH)
    bars = []
    for what, here, there, bar in [
        ('certain', x_i, x_f, 0.2), ('uncertain', soft_i, soft_f, None),
    ]:  # fmt: skip
        spent = []
        for _ in range(7):
            begin = time.process_time()
            model.goal_posterior(here, there)
            spent.append(time.process_time() - begin)
        median = float(np.median(spent))
        bars += [
            Bar(f'batch of 10^6 {what}', median, bar, 's', n=len(spent)),
            Bar(f'batch rate {what}', BATCH / median / 1e6, None, '10^6/s', n=len(spent)),
        ]
    return bars


def random_counts(states: int, actions: int, results: int) -> sparse.csr_array:
    """Counts in which each action leads to a few states, shape [x_i * a, x_f]."""
    rng, rows = np.random.default_rng(0), states * actions
    columns: NDArray[np.int64] = rng.integers(0, states, (rows, results)).ravel()
    data = rng.integers(1, 10, rows * results)
    indptr = np.arange(0, rows * results + 1, results)
    counts = sparse.csr_array((data, columns, indptr), shape=(rows, states))
    counts.sum_duplicates()
    return counts


def growth(calls: int) -> tuple[list[Bar], dict[str, str]]:
    """Time of a goal posterior and memory of the model, two results an action."""
    notes = {}
    for states, actions in SIZES:
        counts = random_counts(states, actions, 2)
        thin = SparseGoalModel.of_counts(counts, actions)
        parts = (thin.trial.data, thin.trial.indices, thin.trial.indptr, thin.background)
        memory = sum(part.nbytes for part in parts)
        x_f = int(counts[[0]].indices[0])
        (t,) = timed([lambda *_, m=thin, y=x_f: m.goal_posterior(0, y)], (max(50, calls // 10),))
        said = f'{counts.nnz} non-zeros, {memory / 1024:.0f} KiB, p50 {t.p50 * 1e6:.0f} us'
        if states <= PEER_STATES:
            dense = GoalModel.of(TransitionModel(_dense(counts, actions)).transition)
            peer = Agrum(dense)
            ours, theirs = timed(
                [lambda *_, m=dense, y=x_f: m.goal_posterior(0, y),
                 lambda *_, m=peer, y=x_f: m.goal_posterior(0, y)],
                (50, 20),
            )  # fmt: skip
            said += f'; dense {ours.p50 * 1e6:.1f} us, pyAgrum {theirs.p50 * 1e6:.0f} us'
        notes[f'{states} states x {actions} actions x {states} goals'] = said
    bars = [
        Bar('sparse posterior, 1000 x 50 x 1000', t.p50 * 1e3, None, 'ms', n=t.n),
        Bar('memory per non-zero', memory / counts.nnz, 32, 'byte', n=counts.nnz,
            peer='12 bytes of an entry, and its share of a row'),
    ]  # fmt: skip
    return bars, notes


def _dense(counts: sparse.csr_array, actions: int) -> NDArray[np.int64]:
    states = counts.shape[1]
    return np.asarray(counts.toarray(), dtype=np.int64).reshape(states, actions, states)


def main() -> None:
    """Measure and publish."""
    parser = option_parser('inference')
    parser.add_argument('--calls', type=whole_number, default=2000)
    calls = parser.parse_args().calls
    grown, notes = growth(calls)
    publish('inference', [*single(calls), *batches(), *grown], notes)


if __name__ == '__main__':
    main()
