"""The Calibrate screen: cameras calibrated from photographs of a board, and their uncertainty."""
