"""Gaze following by Gaussian processes: the paper's continuous model (Case I; Fig 1, 4, 5, 6).

Lengths in cm, angles in rad; no ROS.

model = GazeModel.simulated(seed=1)
follower = GazeFollower(model, agent=Pose2(0.0, 0.0, 0.0))
follower.start(Pose2(600.0, 0.0, 3.14))
following = follower.observe(Pose2(600.0, 0.0, 2.36), distance=424.0)
following.goal.mean, following.action.mean
"""

from likeme_gaze.beliefs import Gaussian, known
from likeme_gaze.blindfold_detection import blindfold_probability
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
from likeme_gaze.gaze_model import GazeModel
from likeme_gaze.gp.gaussian_processes import GaussianProcesses, OutputMoments
from likeme_gaze.gp.training import HyperparameterSearch, fit
from likeme_gaze.reverse import Evidence, ReverseInference, infer_goal, reverse_inference
from likeme_gaze.simulation import (
    Experience,
    SimulationSetup,
    blindfolded_experience,
    experience_of,
    goal_prior,
    self_experience,
)

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
    'HyperparameterSearch',
    'Mentor',
    'OutputMoments',
    'Pose2',
    'ReverseInference',
    'SimulationSetup',
    'Viewpoints',
    'blindfold_probability',
    'blindfolded_experience',
    'experience_of',
    'fit',
    'follow_gaze',
    'forward_inference',
    'goal_prior',
    'infer_goal',
    'known',
    'reverse_inference',
    'self_experience',
]
