"""What the paper states in words and numbers where it draws figures (Chung et al. 2015)."""

from __future__ import annotations

#: The section "Gaze Following: Model Simulations" and the caption.
FIG_4 = (
    'The paper: agent at (0, 0), mentor at (600, 0), five observations (text and Fig 4); it gives '
    'no number of how far off its goals are.'
)
#: The section "Gaze Following: Model Performance" and the caption.
FIG_5 = (
    'The paper: 200 training points, 375 test points, five observations, less than a minute; the '
    'error grows from (a) to (c). Fig 5 is histograms; it gives no number of an error.'
)
#: The section "Blindfold Self-Experience Task" and the caption.
FIG_6 = (
    'The paper: 60 agents in three groups, 15 training points, 4 trials, turns of at least 30 '
    'degrees. Fig 6 is bars; it gives no number of a score.'
)
#: The section "Robotic Tabletop Manipulation Task"; the authors published the trials.
FIG_7 = (
    'The paper: 10 trials of each action, initial state and object. Fig 7 is bars; it gives no '
    'number of a probability.'
)
