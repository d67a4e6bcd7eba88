"""The app in a real Chromium; files that follow one another share it."""
