"""The cell as a Rerun recording: pictures, states, scene, beliefs and decisions over time."""
