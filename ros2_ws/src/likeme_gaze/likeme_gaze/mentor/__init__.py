"""From head poses in messages (SI units, frames, stamps) to the gaze model (cm, one plane).

Units and frames are converted here alone. Inputs that cannot be used are rejected here, with one
sentence and a reason under which they are counted.
"""
