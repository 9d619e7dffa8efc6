"""From a frame to the phase behind it; knows arrays only."""
