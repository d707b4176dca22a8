"""The model in two general engines: pyAgrum (LazyPropagation), pgmpy (VariableElimination)."""

from __future__ import annotations

import logging
import warnings
from typing import Any, Protocol

import numpy as np
import pyagrum as gum
from numpy.typing import NDArray

with warnings.catch_warnings():
    # pgmpy warns of its own renamed modules when it is imported.
    warnings.simplefilter('ignore', FutureWarning)
    from pgmpy.factors.discrete import TabularCPD
    from pgmpy.inference import VariableElimination
    from pgmpy.models import DiscreteBayesianNetwork

from likeme_inference.tabletop.goal_model import GoalModel

logging.getLogger('pgmpy').setLevel(logging.ERROR)


class Engine(Protocol):
    """Answers the two questions of an imitation."""

    def goal_posterior(self, x_i: int, x_f: int) -> Any:
        """P(G | x_i, x_f), shape [g]."""

    def decision(self, x_i: int, x_f: int) -> tuple[int, int, float]:
        """MAP goal, MAP action for it, and its predicted success."""


def full_policy(model: GoalModel) -> NDArray[np.float64]:
    """P(A | G, X_i), uniform where no action helps: engines want full tables."""
    policy = model.policy.copy()
    policy[policy.sum(axis=-1) == 0] = 1 / policy.shape[-1]
    return policy


class Agrum:
    """Incremental lazy propagation: the junction tree is built once."""

    def __init__(self, model: GoalModel) -> None:
        states, goals, actions = model.policy.shape
        net = gum.BayesNet()
        for name, size in (('G', goals), ('Xi', states), ('A', actions), ('Xf', states)):
            net.add(gum.RangeVariable(name, name, 0, size - 1))
        for tail, head in (('G', 'A'), ('Xi', 'A'), ('Xi', 'Xf'), ('A', 'Xf')):
            net.addArc(tail, head)
        net.cpt('G').fillWith(model.prior.tolist())
        net.cpt('Xi').fillWith([1 / states] * states)
        _fill(net.cpt('A'), full_policy(model), ('Xi', 'G', 'A'))
        _fill(net.cpt('Xf'), model.transition, ('Xi', 'A', 'Xf'))
        self._net = net
        self._engine = gum.LazyPropagation(net)

    def goal_posterior(self, x_i: int, x_f: int) -> Any:
        """P(G | x_i, x_f)."""
        return self._ask('G', Xi=x_i, Xf=x_f)

    def decision(self, x_i: int, x_f: int) -> tuple[int, int, float]:
        """Three questions, one after the other."""
        goal = int(self.goal_posterior(x_i, x_f).argmax())
        action = int(self._ask('A', Xi=x_i, G=goal).argmax())
        return goal, action, float(self._ask('Xf', Xi=x_i, A=action)[goal])

    def _ask(self, target: str, **evidence: int) -> NDArray[np.float64]:
        self._engine.setTargets({target})
        self._engine.setEvidence(evidence)
        self._engine.makeInference()
        return np.asarray(self._engine.posterior(target).toarray())


def _fill(table: Any, values: NDArray[np.float64], axes: tuple[str, ...]) -> None:
    """Fill a table whose axes pyAgrum ordered by itself."""
    order = [axes.index(name) for name in reversed(table.names)]
    table.fillWith(values.transpose(order).ravel().tolist())


class Pgmpy:
    """Variable elimination anew for each question."""

    def __init__(self, model: GoalModel) -> None:
        states, goals, actions = model.policy.shape
        net = DiscreteBayesianNetwork([('G', 'A'), ('Xi', 'A'), ('Xi', 'Xf'), ('A', 'Xf')])
        policy = full_policy(model).transpose(2, 1, 0).reshape(actions, -1)
        transition = model.transition.transpose(2, 0, 1).reshape(states, -1)
        net.add_cpds(
            TabularCPD('G', goals, model.prior[:, None].tolist()),
            TabularCPD('Xi', states, [[1 / states]] * states),
            TabularCPD('A', actions, policy.tolist(), ['G', 'Xi'], [goals, states]),
            TabularCPD('Xf', states, transition.tolist(), ['Xi', 'A'], [states, actions]),
        )
        self._engine = VariableElimination(net)

    def goal_posterior(self, x_i: int, x_f: int) -> Any:
        """P(G | x_i, x_f)."""
        return self._ask('G', Xi=x_i, Xf=x_f)

    def decision(self, x_i: int, x_f: int) -> tuple[int, int, float]:
        """Three questions, one after the other."""
        goal = int(self.goal_posterior(x_i, x_f).argmax())
        action = int(self._ask('A', Xi=x_i, G=goal).argmax())
        return goal, action, float(self._ask('Xf', Xi=x_i, A=action)[goal])

    def _ask(self, target: str, **evidence: int) -> NDArray[np.float64]:
        return np.asarray(self._engine.query([target], evidence, show_progress=False).values)
