"""The page of a planar pad: press on it, see its fringes in colour, read its forces."""
