"""Whether the planner's promises hold: suggested cameras are rendered, and the chain is run again."""
