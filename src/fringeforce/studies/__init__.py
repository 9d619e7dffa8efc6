"""Which sensor should I build?  Range, resolution, sensitivity, sweeps and optimisation."""
