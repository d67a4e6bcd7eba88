"""Small faults planted into modules that hold formulae, to see whether their tests fail."""
