"""The log of a run, its files, and what is counted from it: ledger, counters, states, conservation."""
