"""Numbers of a run, computed from its trace: metrics, energy, coverage, arrivals."""
