"""What each screen puts into the 3-D scene."""
