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
| goals over all objects, while they are shown | `JointGoals`, `Attempt`, `Watcher`, `GoalTest` |
| an object without trials | `Prior`, `StructuredPrior` |
| asking by cost, or so that a promise is kept | `choose_by_cost`, `cost_plan`, `Promise` |
| batches of objects or models | `posterior_table`, `direct_policy`, `plan`, `spread` |
| many states, sparse | `SparseGoalModel` |
| draws of the posterior, as .npz and for ArviZ | `posterior_draws`, `save_draws`, `to_arviz` |
| predictive checks | `posterior_check`, `held_out_check`, `exchangeable_check` |
| sensitivity to the prior | `prior_sensitivity`, `turning_points` |

    from likeme_core.world import load_world
    from likeme_inference.tabletop import shipped
    left, right, offtable = load_world('chung2015').states
    pear = shipped().goal_model('pear')
    pear.goal_posterior(left, right)   # array([0.02343878, 0.9684478 , 0.00811342])
"""

from likeme_core.tabletop import Action, Manner, Mode, State
from likeme_inference.tabletop.action_selection import Choice, Kind, choose
from likeme_inference.tabletop.active_exploration import help_rate, information_gain
from likeme_inference.tabletop.arviz_export import to_arviz
from likeme_inference.tabletop.attempts import Attempt, Stopped
from likeme_inference.tabletop.cost_planning import Costs, choose_by_cost, cost_plan
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
from likeme_inference.tabletop.goal_test import GoalTest
from likeme_inference.tabletop.joint_goals import JointGoals
from likeme_inference.tabletop.joint_watcher import Watcher
from likeme_inference.tabletop.model_file import load, save, shipped
from likeme_inference.tabletop.planning import Plan, plan, spread
from likeme_inference.tabletop.posterior_file import load_draws, save_draws
from likeme_inference.tabletop.posterior_sampling import Draws, PosteriorDraws, posterior_draws
from likeme_inference.tabletop.predictive_check import (
    PredictiveCheck,
    exchangeable_check,
    halves,
    held_out_check,
    holm,
    posterior_check,
)
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.promise import Promise
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_inference.tabletop.sensitivity import (
    PriorSensitivity,
    PriorSetting,
    ShownChange,
    TurningPoint,
    prior_sensitivity,
    turning_points,
)
from likeme_inference.tabletop.sparse import SparseGoalModel
from likeme_inference.tabletop.structured_prior import StructuredPrior
from likeme_inference.tabletop.transition_model import TransitionModel, maximum_likelihood

__all__ = [
    'CONCENTRATION',
    'TABLETOP',
    'Action',
    'Attempt',
    'Choice',
    'Costs',
    'Domain',
    'Draws',
    'GoalModel',
    'GoalTest',
    'JointGoals',
    'Kind',
    'Manner',
    'Mode',
    'Plan',
    'Policy',
    'PosteriorDraws',
    'PredictiveCheck',
    'Prior',
    'PriorSensitivity',
    'PriorSetting',
    'Promise',
    'RobotModel',
    'ShownChange',
    'SparseGoalModel',
    'State',
    'Stopped',
    'StructuredPrior',
    'TransitionModel',
    'TrialCounts',
    'TurningPoint',
    'Watcher',
    'aimed_prior',
    'choose',
    'choose_by_cost',
    'cost_plan',
    'credible_interval',
    'direct_policy',
    'domain_of',
    'exchangeable_check',
    'explore',
    'explored_policy',
    'halves',
    'held_out_check',
    'help_rate',
    'holm',
    'information_gain',
    'leave_one_out',
    'load',
    'load_draws',
    'map_goal',
    'map_index',
    'maximum_likelihood',
    'plan',
    'posterior_check',
    'posterior_draws',
    'posterior_table',
    'prior_sensitivity',
    'reinforced',
    'sample_transitions',
    'save',
    'save_draws',
    'shipped',
    'spread',
    'to_arviz',
    'turning_points',
]
