"""Output folders of commands: a reconstruction, a delivery, a registered pair."""
