"""Search for the pose between two clouds: starts, quick registrations, their evidence, and a verdict."""
