"""From the drawing of a photoelastic tactile sensor to forces read from its fringes."""
