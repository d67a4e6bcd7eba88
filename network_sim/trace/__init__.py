"""The event log of a run, its files, and sums over it: ledger, counters, radio states, conservation."""
