"""What the robot thinks: goals, actions, predictions and when to ask (Chung et al. 2015)."""
