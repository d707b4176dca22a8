"""The discrete model of the paper (Methods, Case II); no ROS.

| paper | here |
| --- | --- |
| states, actions, goals | `Domain`, `domain_of` a world; that of the paper is `TABLETOP` |
| Fig 3a, Fig 7: p(X_f given X_i, A), learned from trials | `TransitionModel`, `dirichlet` |
| Fig 3b: p(A given x_i, x_f) | `GoalModel.action_posterior` |
| Fig 3c: p(A given G, X_i), both variants | `direct_policy`, `explored_policy`, `explore` |
| Fig 3d, 8a: p(G given x_i, x_f) | `GoalModel.goal_posterior` |
| Fig 3e, 8b: action for a goal | `GoalModel.action_for`, `choose` |
| Fig 3f, 8c: predicted outcome | `GoalModel.predict` |
| Table 1: the modes | `Mode`, `choose` |
| future work: several actions per goal | `plan`, `spread` |
| future work: choice of the next trial | `information_gain`, `shared_prior` |
| batches of objects or models | `posterior_table`, `direct_policy`, `plan`, `spread` |
| many states, sparse | `SparseGoalModel` |

    from likeme_core.world import load_world
    from likeme_inference.tabletop import shipped
    left, right, offtable = load_world('chung2015').states
    pear = shipped().goal_model('pear')
    pear.goal_posterior(left, right)   # array([0.02343878, 0.9684478 , 0.00811342])
"""

from likeme_core.tabletop import Action, Manner, Mode, State
from likeme_inference.tabletop.action_selection import Choice, Kind, choose
from likeme_inference.tabletop.active_exploration import help_rate, information_gain
from likeme_inference.tabletop.dirichlet import (
    CONCENTRATION,
    aimed_prior,
    credible_interval,
    leave_one_out,
    sample_transitions,
)
from likeme_inference.tabletop.domain import TABLETOP, Policy, domain_of
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.goal_exploration import explore, explored_policy, reinforced
from likeme_inference.tabletop.goal_inference import (
    direct_policy,
    map_goal,
    map_index,
    posterior_table,
)
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.model_file import load, save, shipped
from likeme_inference.tabletop.planning import Plan, plan, spread
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_inference.tabletop.sparse import SparseGoalModel
from likeme_inference.tabletop.transition_model import TransitionModel, maximum_likelihood

__all__ = [
    'CONCENTRATION',
    'TABLETOP',
    'Action',
    'Choice',
    'Domain',
    'GoalModel',
    'Kind',
    'Manner',
    'Mode',
    'Plan',
    'Policy',
    'RobotModel',
    'SparseGoalModel',
    'State',
    'TransitionModel',
    'TrialCounts',
    'aimed_prior',
    'choose',
    'credible_interval',
    'direct_policy',
    'domain_of',
    'explore',
    'explored_policy',
    'help_rate',
    'information_gain',
    'leave_one_out',
    'load',
    'map_goal',
    'map_index',
    'maximum_likelihood',
    'plan',
    'posterior_table',
    'reinforced',
    'sample_transitions',
    'save',
    'shipped',
    'spread',
]
