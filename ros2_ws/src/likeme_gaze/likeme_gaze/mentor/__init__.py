"""A mentor's head as messages bring it (SI units, frames, stamps), made ready for gaze following.

The gaze model speaks cm and one parent frame; everything is converted here, once, and what cannot
be used is refused here, with one sentence and a reason to count it by.
"""
