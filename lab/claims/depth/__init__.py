"""What depth from one picture can do, measured (SPEC 3)."""
