"""The continuous model: gaze following by Gaussian processes (Case I, Fig 1, 4, 5 and 6).

model = GazeModel.simulated(seed=1)
follower = GazeFollower(model, agent=Pose2(0.0, 0.0, 0.0))
follower.start(Pose2(600.0, 0.0, 3.14))
following = follower.observe(Pose2(600.0, 0.0, 2.36), distance=424.0)
following.goal.mean, following.action.mean
"""

from likeme_gaze.beliefs import Gaussian, known
from likeme_gaze.blindfold_detection import eyes_covered
from likeme_gaze.chain import HeadModel
from likeme_gaze.follower import GazeFollower, Mentor
from likeme_gaze.following import (
    Following,
    Forward,
    Viewpoints,
    follow_gaze,
    forward_inference,
)
from likeme_gaze.frames import Pose2
from likeme_gaze.gaussian_processes import GaussianProcesses, Moments
from likeme_gaze.gaze_model import GazeModel
from likeme_gaze.reverse import Evidence, Reversed, infer_goal, reverse_inference
from likeme_gaze.simulation import (
    Experience,
    SimulationSetup,
    blindfolded_experience,
    experience_of,
    goal_prior,
    self_experience,
)
from likeme_gaze.training import Search, fit

__all__ = [
    'Evidence',
    'Experience',
    'Following',
    'Forward',
    'Gaussian',
    'GaussianProcesses',
    'GazeFollower',
    'GazeModel',
    'HeadModel',
    'Mentor',
    'Moments',
    'Pose2',
    'Reversed',
    'Search',
    'SimulationSetup',
    'Viewpoints',
    'blindfolded_experience',
    'experience_of',
    'eyes_covered',
    'fit',
    'follow_gaze',
    'forward_inference',
    'goal_prior',
    'infer_goal',
    'known',
    'reverse_inference',
    'self_experience',
]
