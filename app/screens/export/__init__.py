"""Export: take the results along."""
